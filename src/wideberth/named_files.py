"""TOML files that are given by a path, or by their bare name in a folder that is known for them."""

from pathlib import Path

from wideberth.errors import InputError


def find_named(given: str, folder: Path, what: str) -> Path:
    """Return the file that is meant: a path, or the bare name of a file in `folder`.

    Parameters
    ----------
    given : str
    folder : Path
    what : str
        What such a file is, for messages.

    Raises
    ------
    InputError
        If there is no such file.
    """
    path = Path(given)
    if path.is_file():
        return path
    if path.name == given:
        inside = folder / (given if path.suffix == ".toml" else f"{given}.toml")
        if inside.is_file():
            return inside
        known = ", ".join(sorted(p.stem for p in folder.glob("*.toml"))) or f"none: there is no {folder} folder here"
        raise InputError(f"{given}: no such {what}; give the path of a TOML file, or a name in {folder} ({known})")
    raise InputError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
