"""State shared by the tests of one pytest session: loaded missions and outcome coverage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.read import find_shipped
from glotouch_bt.mission_testing.casting import ScriptError
from glotouch_bt.mission_testing.coverage import OutcomeCoverage
from glotouch_bt.robot import UnknownName


class Session:
    """Loads each mission once and collects coverage.

    Args:
        root: pytest's root.

    Attributes:
        coverage: Endings exercised so far.
    """

    def __init__(self, root: Path) -> None:
        self.coverage = OutcomeCoverage()
        self._root = root
        self._loaded: dict[Any, Mission] = {}

    def load(
        self,
        given: str | Path,
        settings: Mapping[str, Any],
        objects: Path | None,
        skills: Mapping[str, Any] | None,
        here: Path,
    ) -> Mission:
        """Load a mission for a test; cached while its file does not change.

        Raises:
            ScriptError: A setting is no parameter of the mission.
            BadInput: It cannot be read, or has findings.
        """
        path = self.find(given, here)
        stat = path.stat()
        known = (path, stat.st_mtime_ns, stat.st_size, repr(sorted(settings.items())), objects, id(skills))
        if known not in self._loaded:
            self._loaded[known] = load_mission(path, settings, objects=objects, skills=skills)
        mission = self._loaded[known]
        for name in settings:
            if name not in mission.parameters:
                raise ScriptError(str(UnknownName("setting", name, mission.parameters)))
        return mission

    def find(self, given: str | Path, *folders: Path) -> Path:
        """Return a mission's file: relative to the folders and their parents below pytest's root, or shipped.

        The root itself and the working directory come last. The path is relative to the working directory if possible.

        Raises:
            BadInput: There is no such file.
        """
        above = [p for folder in folders for p in (folder, *folder.parents) if p.is_relative_to(self._root)]
        for folder in (*folders, *above, self._root, Path()):
            if Path(given).suffix in (".yaml", ".yml") and (folder / given).is_file():
                found = (folder / given).resolve()
                return found.relative_to(Path.cwd()) if found.is_relative_to(Path.cwd()) else found
        return find_shipped("", str(given), "mission")
