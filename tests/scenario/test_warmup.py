"""After the warm-up, runs compile nothing more."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.adsb_frames import flight

pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="runs without the compiler")

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = """
import importlib, json, sys
from pathlib import Path
from wideberth import kernel_modules
from wideberth.config import load_scenario
from wideberth.run import run_scenario

path, only_loaded, *overrides = json.loads(sys.argv[1])
scenario = load_scenario(Path(path), overrides)
for name in kernel_modules.loaded() if only_loaded == "loaded" else kernel_modules.names():
    kernel_modules.warm_up(name)
kernels = [k for n in kernel_modules.names() for k in kernel_modules.kernels_of(importlib.import_module(n))]
before = [set(k.signatures) for k in kernels]
summary = run_scenario(scenario, None, report=False)
new = {f"{k.__module__}.{k.__name__}": set(k.signatures) - b for k, b in zip(kernels, before)}
late = {name: str(signatures) for name, signatures in new.items() if signatures}
print("RESULT", json.dumps({"late": late, "intruders": summary["intruders"]}))
"""


def late_compilations(scenario: Path, *overrides: str, warm: str = "all") -> tuple[dict[str, str], int]:
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_DISABLE_JIT"}
    arguments = [sys.executable, "-c", SCRIPT, json.dumps([str(scenario), warm, *overrides])]
    done = subprocess.run(arguments, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout.splitlines()[-1].removeprefix("RESULT "))
    return result["late"], result["intruders"]


def test_simulated_run_compiles_nothing_after_the_warm_up() -> None:
    late, intruders = late_compilations(ROOT / "scenarios" / "adsb_crossing.toml", "duration_s=130")
    assert intruders == 3
    assert late == {}


@pytest.mark.parametrize("name", ["adsb_crossing", "ground_radar", "gbr_1"])
def test_the_kernels_that_a_scenario_loads_are_all_that_it_needs(name: str) -> None:
    late, _ = late_compilations(ROOT / "scenarios" / f"{name}.toml", "duration_s=40", warm="loaded")
    assert late == {}


def test_recorded_run_compiles_nothing_after_the_warm_up(tmp_path: Path) -> None:
    lines = [
        json.dumps({"timestamp": t, "frame": frame.hex()})
        for t, frame in flight(0x4B1234, latitude=48.05, north_kt=-100, duration=130.0)
    ]
    recording = tmp_path / "frames.jsonl"
    recording.write_text("\n".join(lines) + "\n")
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(f"""
        [mission]
        start_time_s = 1000.0
        speed_mps = 41.0
        waypoints = [
            {{ lat_deg = 48.0, lon_deg = 2.0, altitude_m = 914.0 }},
            {{ lat_deg = 48.04, lon_deg = 2.0, altitude_m = 914.0 }},
        ]
        [traffic]
        kind = "recorded"
        path = "{recording.as_posix()}"
    """)
    late, intruders = late_compilations(scenario, "duration_s=100")
    assert intruders == 1
    assert late == {}
