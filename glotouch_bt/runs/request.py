"""The request for a run, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from glotouch_bt.mission.execution import Outcome
from glotouch_bt.mission.read import split_conditions

if TYPE_CHECKING:
    from glotouch_bt.faults import FaultPlan


@dataclass(frozen=True)
class RunRequest:
    """A request for a run.

    Attributes:
        mission: Path or shipped name.
        backend: Name of a registered backend.
        seed: Source of every random draw, 0 .. 2**32 - 1.
        settings: `--set` values: mission parameters; names that are no parameter go to the backend.
        world: Path or shipped name of a world instead of the mission's.
        objects: Folder of STL files instead of the world's.
        conditions: Path or shipped name, with changes as in `load_conditions`.
        out: The run's folder (default: runs/<time>-<mission>-s<seed>).
        faults: A fault plan: a path, the name of a shipped plan, or a plan that has been read.
        may_kill: A fault may kill this process, because it does nothing but this run.
        report: Make report.html.
        overwrite: Replace an earlier run in `out`; otherwise `out` must be new or empty.
        allow_paths: Folders in which subtrees may be, besides the mission's own.
    """

    mission: str
    backend: str = "mujoco"
    seed: int = 0
    settings: Mapping[str, str] = field(default_factory=dict)
    objects: Path | None = None
    conditions: str = "nominal"
    out: Path | None = None
    faults: str | Path | FaultPlan | None = None
    may_kill: bool = False
    report: bool = True
    overwrite: bool = True
    allow_paths: tuple[Path, ...] = ()
    world: str | None = None

    def as_json(self) -> dict[str, Any]:
        """Return what is needed to open the same robot and mission again, as JSON data."""
        profile, changes = split_conditions(self.conditions)
        plan = self.faults if self.faults is None or isinstance(self.faults, str | Path) else self.faults.name
        return {
            "mission": _absolute(self.mission),
            "backend": self.backend,
            "seed": self.seed,
            "settings": dict(self.settings),
            "objects": None if self.objects is None else str(self.objects.resolve()),
            "conditions": "+".join([_absolute(profile), *changes]),
            "faults": None if plan is None else str(plan),
        }


@dataclass(frozen=True)
class RunResult:
    """The result of a run.

    Attributes:
        folder: The run's folder.
        result: The content of result.json.
        outcome: Outcome of the mission.
        report: Path of report.html, or None.
        warning: Why the report could not be made, or empty.
        unwritten: Files that could not be written, with the reason.
    """

    folder: Path
    result: Mapping[str, Any]
    outcome: Outcome
    report: Path | None
    warning: str = ""
    unwritten: tuple[str, ...] = ()

    @property
    def status(self) -> Literal["success", "failure", "aborted"]:
        """End of the mission: success, failure, or aborted by a stop or a fault."""
        return self.outcome.status

    @property
    def reasons(self) -> list[str]:
        """Reasons for a failure or an abort, root cause last; empty after a success."""
        return self.outcome.reasons

    @property
    def outputs(self) -> dict[str, Any]:
        """Last value of each key that a skill wrote, as JSON data from the record (large arrays as a summary)."""
        from glotouch_bt.report import read_run

        return {write.key: write.value for write in read_run(self.folder).ports}

    @property
    def exit_code(self) -> int:
        """0 success, 1 the mission failed, 3 aborted or a file could not be written, 130 interrupted."""
        if isinstance(self.outcome.error, KeyboardInterrupt):
            return 130
        if self.unwritten:
            return 3
        return {"success": 0, "failure": 1, "aborted": 3}[self.outcome.status]


def _absolute(given: str) -> str:
    """Return a file's absolute path; return a shipped name unchanged."""
    return str(Path(given).resolve()) if Path(given).suffix in (".yaml", ".yml") and Path(given).is_file() else given
