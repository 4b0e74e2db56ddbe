"""Find shipped missions, worlds and conditions, and the installed skills."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Mapping
from functools import cache
from os.path import isfile
from pathlib import Path

from glotouch_bt.mission.read.declarations import declaration_fault
from glotouch_bt.plugins import plugins
from glotouch_bt.robot import BadInput, UnknownName
from glotouch_bt.skill import Skill

SKILL_GROUP = "glotouch_bt.skills"
RESUME_CHECK_GROUP = "glotouch_bt.resume_check"
"""Entry-point group of the one skill that checks the world before a mission resumes in it."""


@cache
def shipped_root() -> Path:
    """Return the folder of shipped missions, of a checkout or of the installed package.

    It stands beside this package. An import could find a folder of the same name in the user's directory.
    """
    return Path(__file__).resolve().parents[3] / "glotouch_missions"


def shipped(kind: str) -> dict[str, Path]:
    """Return the shipped files by name; kind is "" (missions) or the name of a folder of shipped files."""
    return {p.stem: p for p in sorted((shipped_root() / kind).glob("*.yaml"))}


def find_shipped(kind: str, given: str, what: str) -> Path:
    """Return the path as given, or the shipped file of that name.

    Raises:
        UnknownName: Neither a file nor a shipped name.
        BadInput: Looks like a path, but no such file.
    """
    path = Path(given)
    if path.suffix in (".yaml", ".yml") or "/" in given:
        if isfile(path):  # unlike Path.is_file, false for names that no file can have
            return path
        if not path.is_absolute() and isfile(inside := shipped_root() / given):
            return inside
        raise BadInput(f"{given}: no such {what} file (shipped: {', '.join(shipped(kind))})")
    found = shipped(kind)
    if given not in found:
        raise UnknownName(what, given, found)
    return found[given]


def shown(path: Path) -> str:
    """Return the name of a file in messages and records. Shipped files are named relative to their root."""
    try:
        return f"glotouch_missions/{path.resolve().relative_to(shipped_root())}"
    except ValueError:
        return str(path)


def _fault_of_module(error: Exception) -> str:
    """Return an error of a skill's module with its place."""
    if isinstance(error, SyntaxError):
        return f"{error.filename}:{error.lineno}: {error.msg}"
    if isinstance(error, ImportError | AttributeError):
        return str(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{last.filename}:{last.lineno}: {type(error).__name__}: {error}"


class SkillRegistry(Mapping[str, type[Skill]]):
    """Installed skills by name. A skill's module is imported on first use.

    Args:
        group: Entry-point group; that of mission skills, or `RESUME_CHECK_GROUP`.

    Raises:
        UnknownName: On looking up a name that is not registered.
        BadInput: On looking up a skill whose module cannot be imported here, with the place of the fault; or one that
            declares something impossible.
    """

    def __init__(self, group: str = SKILL_GROUP) -> None:
        self._group = group
        self._points = plugins(group)
        self._loaded: dict[str, type[Skill]] = {}

    def __getitem__(self, name: str) -> type[Skill]:
        if name not in self._points:
            raise UnknownName("skill", name, self._points)
        if name not in self._loaded:
            try:
                found = self._points[name].load()
            except Exception as e:  # the module of a skill may raise anything
                raise BadInput(f"skill {name!r} cannot be used here: {_fault_of_module(e)}") from e
            if not (isinstance(found, type) and issubclass(found, Skill)):
                raise BadInput(f"entry point {name!r} of {self._group} is not a Skill class")
            if fault := declaration_fault(found):
                raise BadInput(f"skill {name!r} cannot be used here: {found.__name__}: {fault}")
            self._loaded[name] = found
        return self._loaded[name]

    def __contains__(self, name: object) -> bool:
        return name in self._points

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._points))

    def __len__(self) -> int:
        return len(self._points)
