"""The manifest of a Monte Carlo run: everything that its rows depend on."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.atomic_files import create
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.plan import Block, Plan

MANIFEST = "montecarlo.json"
_FORMAT = 2
_PACKAGE = Path(__file__).resolve().parents[2]


def code_hash(package: Path = _PACKAGE) -> str:
    """Return a short hash over all Python sources of the package that rows may depend on.

    Those of the command line and of the reports apart, which only show them.
    """
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package)
        if name.parts[0] == "cli" or (name.parts[0] == "evaluation" and name.name.startswith("report")):
            continue
        content = path.read_bytes()
        digest.update(f"{name.as_posix()} {len(content)} ".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a folder holds rows of: two runs with the same manifest, block size apart, give the same rows.

    Attributes
    ----------
    experiment : dict
        `Experiment.resolved`.
    digest : str
        Of the experiment.
    seed : int
        Of this run; the experiment's own unless another was asked for.
    avoidance : bool
    encounters : int
        For each number of intruders.
    intruders : tuple of int
        Rising.
    block_rows : int
        See `Plan`; rows do not depend on it.
    version : str
        Of this package.
    code : str
        `code_hash`.
    """

    experiment: dict[str, Any]
    digest: str
    seed: int
    avoidance: bool
    encounters: int
    intruders: tuple[int, ...]
    block_rows: int
    version: str
    code: str

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        seed: int,
        avoidance: bool,
        encounters: int,
        intruders: tuple[int, ...],
        block_rows: int,
    ) -> Self:
        """Return the manifest of a run by the code as it is."""
        from importlib.metadata import version

        return cls(
            experiment=experiment.resolved(),
            digest=experiment.digest(),
            seed=seed,
            avoidance=avoidance,
            encounters=encounters,
            intruders=intruders,
            block_rows=block_rows,
            version=version("wideberth"),
            code=code_hash(),
        )

    @property
    def plan(self) -> Plan:
        """The blocks of the run."""
        return Plan(self.encounters, self.intruders, self.block_rows)

    def shard_metadata(self, block: Block) -> dict[str, Any]:
        """Return what the shard of a block says of itself."""
        return {
            "digest": self.digest,
            "seed": self.seed,
            "avoidance": self.avoidance,
            "code": self.code,
            "version": self.version,
            "intruders": block.intruders,
            "first": block.first,
            "count": block.count,
        }

    def check_same(self, wanted: "Manifest", path: Path) -> None:
        """Refuse to go on with this run as another one.

        Parameters
        ----------
        wanted : Manifest
            The run that was asked for; its block size does not matter.
        path : Path
            Folder of this run, for the message.

        Raises
        ------
        InputError
            With what is different.
        """
        for key in ("version", "code"):
            there, here = getattr(self, key), getattr(wanted, key)
            if there != here:
                raise InputError(
                    f"{path} was made by other code ({key} {there} there, {here} here), whose numbers would not fit: "
                    "start anew in another folder"
                )
        differences = [
            _difference(key, getattr(self, key), getattr(wanted, key))
            for key in ("seed", "avoidance", "encounters", "intruders")
            if getattr(self, key) != getattr(wanted, key)
        ]
        if self.digest != wanted.digest:
            changed = _changed(self.experiment, wanted.experiment)
            differences += changed or [_difference("digest", self.digest, wanted.digest)]
        if differences:
            more = f"; and {len(differences) - 4} more" if len(differences) > 4 else ""
            raise InputError(
                f"{path} holds a run with other settings ({'; '.join(differences[:4])}{more}): give the same again, or "
                "another folder"
            )


def create_manifest(folder: Path, manifest: Manifest) -> bool:
    """Write the manifest into a folder that has none; return False, and write nothing, where it has one.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    text = json.dumps({"format": _FORMAT, **asdict(manifest)}, indent=2, allow_nan=False) + "\n"
    return create(folder / MANIFEST, text.encode())


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a run's folder.

    Raises
    ------
    InputError
        If there is none, or it is damaged, or of another version's form.
    """
    path = folder / MANIFEST
    try:
        data = json.loads(path.read_bytes())
        if data.pop("format") != _FORMAT:
            raise InputError(f"{path}: written by another version of wideberth: give another folder")
        manifest = Manifest(**{**data, "intruders": tuple(data["intruders"])})
        numbers = (manifest.encounters, manifest.block_rows, *manifest.intruders)
        if not manifest.intruders or not all(type(n) is int and n > 0 for n in numbers):
            raise ValueError
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{folder}: no {MANIFEST}; give a folder that `wideberth montecarlo --out` wrote") from None
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError(f"{path}: damaged: give another folder") from None
    return manifest


def _changed(found: Any, wanted: Any, path: str = "") -> list[str]:
    """Return which settings differ, each with both values; name and description do not count."""
    if isinstance(found, Mapping) and isinstance(wanted, Mapping):
        keys = [k for k in dict.fromkeys([*found, *wanted]) if path or k not in ("name", "description")]
        return [line for k in keys for line in _changed(found.get(k), wanted.get(k), f"{path}.{k}" if path else k)]
    return [] if found == wanted else [_difference(path, found, wanted)]


def _difference(key: str, there: Any, here: Any) -> str:
    return f"{key} {_text(there)} there, {_text(here)} here"


def _text(value: Any) -> str:
    text = "unset" if value is None else json.dumps(value, default=str)
    return text if len(text) <= 40 else text[:37] + "..."
