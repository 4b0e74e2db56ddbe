"""A simulated run's world, put back to what it was when a skill had ended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.mission import split_settings
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile, CheckpointRow
from glotouch_bt.mission.read import conditions_of
from glotouch_bt.robot import Backend, Robot, load_backend
from glotouch_bt.runs.folder import require_run_folder
from glotouch_bt.runs.result import truth
from glotouch_bt.runs.resume_point import mission_of_run, stored_run
from glotouch_bt.runs.robot_identity import require_same_robot


@dataclass(frozen=True)
class PastWorlds:
    """The worlds that a run's checkpoints hold, one at a time.

    Attributes:
        name: Name of the backend.
        backend: The backend.
        robot: Its robot, in a world built anew.
        rows: Checkpoints with a world, in the order of time.
    """

    name: str
    backend: Backend
    robot: Robot
    rows: tuple[CheckpointRow, ...]
    _file: CheckpointFile

    def restore(self, row: CheckpointRow) -> None:
        """Put the world back to what it was at one of `rows`."""
        world = self._file.world(row.number)
        assert world is not None
        self.robot.restore(world)

    def objects(self, row: CheckpointRow) -> list[Any]:
        """Put the world back and return its objects as in truth.json; empty if the backend tells no truth.

        They lack `in_gripper`: a checkpoint has no contacts.
        """
        self.restore(row)
        referee = self.backend.referee(self.robot)
        found = [] if referee is None else truth(referee.objects())
        return [{key: value for key, value in one.items() if key != "in_gripper"} for one in found]


@contextmanager
def past_worlds(
    folder: Path, objects: Path | None = None, settings: Mapping[str, str] | None = None
) -> Iterator[PastWorlds]:
    """Build the world of a finished run again, without running its mission.

    Args:
        folder: The run's folder.
        objects: Folder of STL files, if the run was made with one.
        settings: As the run was started with. The run's folder itself does not choose a backend option that names a
            file, such as that of a robot.

    Raises:
        BadInput: The run has no checkpoints or was made with another robot, or its mission cannot be loaded.
        BackendError: The world cannot be built.
    """
    require_run_folder(folder)
    file = CheckpointFile(folder / CHECKPOINT_FILE)
    try:
        run = stored_run(file)
        request = run["request"]
        mission = mission_of_run(folder, run, objects)
        backend = load_backend(request["backend"])
        asked = split_settings(mission, request["settings"])
        portable = {n: value for n, value in asked.items() if backend.is_portable(n, value)}
        options = {**portable, **split_settings(mission, settings or {})}
        conditions = conditions_of(run["conditions"], f"{folder}: conditions")
        with backend.open(mission.world, conditions, request["seed"], options) as robot:
            require_same_robot(folder, run, robot.description)
            rows = tuple(row for row in file.rows() if row.has_world)
            yield PastWorlds(request["backend"], backend, robot, rows, file)
    finally:
        file.close()
