"""Write the clean folder: one STL for each object, and a page that shows them."""

from __future__ import annotations

from collections.abc import Sequence
from os.path import isdir
from pathlib import Path

from glotouch_bt.errors import BadInput
from glotouch_bt.objects.prepare import Prepared
from glotouch_bt.untrusted import write_file

PAGE = "objects.html"


def check_free(folder: Path, source: Path, overwrite: bool) -> None:
    """Require that a clean folder can be written: a new or empty one, or with `overwrite` an earlier one.

    Raises:
        BadInput: It holds something else, or is the folder of the files themselves.
    """
    if folder.exists() and not isdir(folder):
        raise BadInput(f"--out {folder}: is a file")
    if not isdir(folder):
        return
    if folder.resolve() == (source if isdir(source) else source.parent).resolve():
        raise BadInput(f"--out {folder}: holds the files to read; give another folder")
    there = list(folder.iterdir())
    if not there:
        return
    if not overwrite:
        raise BadInput(f"--out {folder}: is not empty; give another folder, or --overwrite to replace a clean folder")
    others = [p.name for p in there if p.name != PAGE and p.suffix != ".stl"]
    if others or PAGE not in {p.name for p in there}:
        what = f"holds {', '.join(sorted(others)[:3])}" if others else f"has no {PAGE}"
        raise BadInput(f"--out {folder}: is no clean folder ({what}); give another folder")


def write_clean(folder: Path, objects: Sequence[Prepared], html: str) -> None:
    """Write the objects and their page; remove what an earlier call left. See `check_free`, which comes first.

    Raises:
        BadInput: A file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.glob("*.stl"):
            old.unlink()
        for made in objects:
            write_file(folder / f"{made.name}.stl", made.stl)
        write_file(folder / PAGE, html.encode())
    except OSError as e:
        raise BadInput(f"--out {folder}: cannot be written ({e.strerror})") from e
