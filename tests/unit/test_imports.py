"""Who may import whom: what import-linter cannot say."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "wideberth"
# A kernel may use kernels of its own folder and of the folders before it; simulation runs all of them, analysis asks
# about any of them.
STEPS = ["sensors", "tracking", "conflict", "vehicles", "avoidance", "links"]
KERNEL_ORDER = [*STEPS, "simulation", "evaluation", "analysis"]
COMMAND_LINE_MAY_IMPORT = {"typer", "rich", "wideberth.errors", "wideberth.cli"}


def submodule(name: str) -> str | None:
    """The name, if it is a module of ours and not something inside one."""
    file = PACKAGE.parent.joinpath(*name.split("."))
    return name if file.with_suffix(".py").is_file() or (file / "__init__.py").is_file() else None


def imported(path: Path, *, top_level_only: bool = False) -> set[str]:
    """Full names of the modules that a file imports."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = tree.body if top_level_only else list(ast.walk(tree))
    names: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {submodule(f"{node.module}.{alias.name}") or str(node.module) for alias in node.names}
    return names


def within(name: str, packages: set[str]) -> bool:
    return any(name == p or name.startswith(p + ".") for p in packages)


def forbidden_in_kernels(name: str, folder: str) -> bool:
    # NamedTuple bundles arrays; numba compiles it like plain arguments.
    if name in {"math", "typing", "numpy", "numpy.typing", "wideberth._jit"}:
        return False
    parts = name.split(".")
    if not (parts[0] == "wideberth" and len(parts) > 2 and parts[-1].endswith("kernels")):
        return True
    return KERNEL_ORDER.index(parts[1]) > KERNEL_ORDER.index(folder)


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*kernels.py")), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_kernels_import_only_numpy_math_and_kernels_to_their_left(path: Path) -> None:
    folder = path.relative_to(PACKAGE).parts[0]
    assert {n for n in imported(path) if forbidden_in_kernels(n, folder)} == set()


def test_the_rule_for_kernels_finds_offenders() -> None:
    assert forbidden_in_kernels("wideberth.avoidance.kernels", "vehicles")
    assert forbidden_in_kernels("wideberth.conflict.well_clear", "conflict")
    assert forbidden_in_kernels("time", "conflict")
    assert not forbidden_in_kernels("wideberth.vehicles.kernels", "avoidance")


@pytest.mark.parametrize("step", [s for s in STEPS if (PACKAGE / s).is_dir()])
def test_steps_share_nothing_but_kernels_to_their_left(step: str) -> None:
    others = {f"wideberth.{s}" for s in STEPS if s != step}
    if step == "links":
        others.discard("wideberth.sensors")  # links make what sensors give: reports and scans
    offenders = {
        f"{path.relative_to(PACKAGE)} -> {name}"
        for path in (PACKAGE / step).rglob("*.py")
        for name in imported(path)
        if within(name, others) and forbidden_in_kernels(name, step)
    }
    assert offenders == set()


@pytest.mark.parametrize("path", sorted((PACKAGE / "cli").glob("*.py")), ids=lambda p: p.name)
def test_commands_import_nothing_heavy_at_the_top(path: Path) -> None:
    allowed = COMMAND_LINE_MAY_IMPORT | set(sys.stdlib_module_names)
    assert {n for n in imported(path, top_level_only=True) if not within(n, allowed)} == set()


def test_sockets_only_in_live_code() -> None:
    network = {"socket", "socketserver", "select", "selectors", "ssl", "asyncio", "http", "urllib"}
    users = {
        str(path.relative_to(PACKAGE))
        for path in PACKAGE.rglob("*.py")
        if any(within(name, network) for name in imported(path))
    }
    assert {user for user in users if not user.startswith(("live/", "cli/"))} <= {"sensors/adsb/live.py"}


def test_help_loads_neither_numba_nor_scipy() -> None:
    code = (
        "import sys; sys.argv = ['wideberth', '--help']\n"
        "from wideberth.cli.main import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numba', 'scipy', 'numpy', 'pydantic', 'matplotlib', 'pyarrow', 'rs1090'} & set(sys.modules)\n"
        "import resource; usage = resource.getrusage(resource.RUSAGE_SELF)\n"
        "print('HEAVY', sorted(heavy), 'CPU', usage.ru_utime + usage.ru_stime)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    last = done.stdout.splitlines()[-1]
    assert last.startswith("HEAVY [] CPU "), done.stdout
