"""What the tests of one pytest session share: missions loaded once, coverage, and the mutant that is being tried."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.read import find_shipped
from glotouch_bt.mission_testing.casting import ScriptError
from glotouch_bt.mission_testing.coverage import OutcomeCoverage
from glotouch_bt.mission_testing.scripted import ScriptedRun
from glotouch_bt.robot import UnknownName

if TYPE_CHECKING:
    from glotouch_bt.mission_testing.mutation import MutationScore


class Session:
    """See the module's text.

    Args:
        root: pytest's root; relative paths are looked for there too.

    Attributes:
        coverage: Endings exercised so far.
        users: For each mission's file, the ids of the tests that loaded it.
        change: While a mutant is tried: what is done to every loaded mission.
        scores: What came of the mutants of each mission.
        mutation_lines: The same for the terminal.
    """

    def __init__(self, root: Path) -> None:
        self.coverage = OutcomeCoverage()
        self.users: dict[Path, dict[str, None]] = {}
        self.change: Callable[[Mission], Mission] | None = None
        self.scores: list[MutationScore] = []
        self.mutation_lines: list[str] = []
        self._root = root
        self._loaded: dict[Any, Mission] = {}

    def load(
        self,
        given: str | Path,
        settings: Mapping[str, Any],
        objects: Path | None,
        skills: Mapping[str, Any] | None,
        here: Path,
        test: str,
    ) -> Mission:
        """A mission for a test, from memory if it was loaded before and its file has not changed.

        Raises:
            ScriptError: A setting that is no parameter of it: here is no backend that might take it.
            BadInput: It cannot be read, or is faulty.
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
        self.users.setdefault(path.resolve(), {})[test] = None
        return mission if self.change is None else self.change(mission)

    def find(self, given: str | Path, *folders: Path) -> Path:
        """A mission's file: as given, in one of the folders, under the root, or shipped; short where that is possible.

        Raises:
            BadInput: Nowhere.
        """
        for folder in (Path(), *folders, self._root):
            if Path(given).suffix in (".yaml", ".yml") and (folder / given).is_file():
                found = (folder / given).resolve()
                return found.relative_to(Path.cwd()) if found.is_relative_to(Path.cwd()) else found
        return find_shipped("", str(given), "mission")

    def ran(self, mission: Mission, run: ScriptedRun) -> None:
        """Count a run, unless its mission was changed on purpose."""
        if self.change is None:
            self.coverage.add(mission, run)
