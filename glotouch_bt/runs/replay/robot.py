"""A robot that returns the recorded blocks of another one, one per cycle, whatever the command.

It compares each command with the recorded one. While they agree, every fit and decision is repeated on the same data.
After the first command that differs (`divergence`), the recorded data no longer match the commands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import (
    Array,
    BackendError,
    BadInput,
    Command,
    GelImages,
    GripperState,
    Limits,
    Observation,
    Request,
    Robot,
    RobotDescription,
    TactileFrame,
    Ticket,
)

# Tolerances of equal commands: a hundred times the rounding of the record, far below a relevant difference.
SAME_RAD = 1e-4
SAME_M = 1e-5
SAME_M_S = 1e-4
SAME_N = 1e-2


SAMPLES: Mapping[str, tuple[str | int, ...]] = {
    "stamp_s": (), "q": ("dof",), "dq": ("dof",), "position_B_P": (3,), "quat_B_P": (4,), "force_S_N": (3,),
    "torque_S_Nm": (3,),
}  # fmt: skip
CYCLES: Mapping[str, tuple[str | int, ...]] = {
    "stamp_s": (), "samples": (), "gripper_stamp_s": (), "gripper_aperture_m": (), "gripper_force_N": (),
    "gripper_moving": (), "command_q": ("dof",), "command_dq": ("dof",), "command_aperture_m": (),
    "command_speed_m_s": (), "command_force_N": (), "command_tactile": (),
}  # fmt: skip
TACTILE: Mapping[str, tuple[str | int, ...]] = {
    "stamp_s": (), "arrived_s": (), "left_m": ("rows", "columns"), "right_m": ("rows", "columns"),
}  # fmt: skip
IMAGES: Mapping[str, tuple[str | int, ...]] = {
    "stamp_s": (), "arrived_s": (), "left": ("rows", "columns", 3), "right": ("rows", "columns", 3),
}  # fmt: skip
"""Shape of one row of each column; words are sizes of the robot."""


def _require_columns(
    given: Mapping[str, Array], expected: Mapping[str, tuple[str | int, ...]], sizes: Mapping[str, int], what: str
) -> None:
    """Require columns of equal length and of the shapes that the robot has, with times that are numbers."""
    if "stamp_s" not in given:
        raise BadInput(f"its {what}s have no times")
    rows = len(given["stamp_s"])
    for name, words in expected.items():
        shape = (rows, *(sizes[w] if isinstance(w, str) else w for w in words))
        if name not in given or given[name].shape != shape:
            raise BadInput(f"its {what}s have no column {name} of shape {shape}")
    if not np.isfinite(given["stamp_s"]).all():
        raise BadInput(f"the time of a {what} is not a number")


class RecordEnded(BackendError):
    """The replay needs a cycle that the record does not have."""


@dataclass(frozen=True)
class Divergence:
    """The first command that differs from the recorded one.

    Attributes:
        cycle: Its number; the first command is 1.
        stamp_s: Robot clock at the end of that cycle.
        what: The difference, with both values.
    """

    cycle: int
    stamp_s: float
    what: str


class ReplayedRobot(Robot):
    """A robot that returns recorded blocks.

    Args:
        description, limits, period_s: Of the recorded robot.
        samples, cycles, tactile: The record's columns (`report.RunRecord`); row 0 of `cycles` was sensed before the
            first command.
        images, image_requests: Those of the record; empty if no gel images were requested.
        done_s: Robot clock at which each slow request was done, and its error, by its number.

    Raises:
        BadInput: A column is missing or has another shape, or the columns do not belong together.
    """

    def __init__(
        self,
        description: RobotDescription,
        limits: Limits,
        period_s: float,
        samples: Mapping[str, Array],
        cycles: Mapping[str, Array],
        tactile: Mapping[str, Array],
        images: Mapping[str, Array],
        image_requests: Mapping[str, Array],
        done_s: Mapping[int, tuple[float, str | None]],
    ) -> None:
        self.description, self.limits, self.period_s = description, limits, period_s
        _require_columns(samples, SAMPLES, {"dof": description.dof}, "sample")
        _require_columns(cycles, CYCLES, {"dof": description.dof}, "cycle")
        if tactile:
            rows, columns = description.gripper.pad_shape
            _require_columns(tactile, TACTILE, {"rows": rows, "columns": columns}, "depth map")
        if images:
            rows, columns = description.gripper.camera.shape if description.gripper.camera else (0, 0)
            _require_columns(images, IMAGES, {"rows": rows, "columns": columns}, "gel image")
        if image_requests:
            _require_columns(image_requests, {"stamp_s": ()}, {}, "request of gel images")
        counts = cycles["samples"]
        if not (np.isfinite(counts).all() and counts.min() >= 1 and counts.sum() <= len(samples["stamp_s"])):
            raise BadInput("its cycles and samples do not belong together")
        self._samples, self._cycles, self._tactile, self._done_s = samples, cycles, tactile, done_s
        self._ends = np.cumsum(cycles["samples"]).astype(np.int64)
        self._images = images

        def cycles_of(columns: Mapping[str, Array], stamp: str) -> npt.NDArray[np.int64]:
            stamps = columns[stamp] if columns else np.zeros(0)
            return np.searchsorted(cycles["stamp_s"], stamps - 0.5 * period_s)

        self._frame_of, self._images_of = cycles_of(tactile, "arrived_s"), cycles_of(images, "arrived_s")
        self._images_asked = frozenset(cycles_of(image_requests, "stamp_s").tolist())
        self._wrench = np.ascontiguousarray(np.concatenate([samples["force_S_N"], samples["torque_S_Nm"]], axis=1))
        self._at = 0
        self._requests = 0
        self._observation = self._block(0)
        self.divergence: Divergence | None = None

    @property
    def left(self) -> int:
        """Number of recorded cycles not yet used."""
        return len(self._ends) - 1 - self._at

    def observe(self) -> Observation:
        """Return the newest block."""
        return self._observation

    def cycle(self, command: Command) -> Observation:
        """Return the next recorded block.

        Raises:
            RecordEnded: The record has no more blocks.
        """
        if self._at + 1 >= len(self._ends):
            raise RecordEnded(f"the record ends at t={self._observation.now_s:.3f} s; the replay needs more")
        self._at += 1
        if self.divergence is None:
            what = self._difference(command, self._at)
            if what:
                self.divergence = Divergence(self._at, float(self._cycles["stamp_s"][self._at]), what)
        self._observation = self._block(self._at)
        return self._observation

    def start(self, request: Request) -> Ticket:
        """Start a request that is done when the recorded one was."""
        stamp_s, error = self._done_s.get(self._requests, (np.inf, None))
        self._requests += 1
        return _Ticket(self, stamp_s, error)

    def hold(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def _block(self, i: int) -> Observation:
        rows = slice(int(self._ends[i - 1]) if i else 0, int(self._ends[i]))
        s, c = {name: column[rows] for name, column in self._samples.items()}, self._cycles
        gripper = GripperState(
            float(c["gripper_stamp_s"][i]),
            float(c["gripper_aperture_m"][i]),
            float(c["gripper_force_N"][i]),
            bool(c["gripper_moving"][i]),
        )
        frame: TactileFrame | None = None
        if (at := _row_of(self._frame_of, i)) is not None:
            t = self._tactile
            frame = TactileFrame(float(t["stamp_s"][at]), t["left_m"][at], t["right_m"][at])
        images: GelImages | None = None
        if (at := _row_of(self._images_of, i)) is not None:
            t = self._images
            left, right = t["left"][at].astype(np.uint8), t["right"][at].astype(np.uint8)
            images = GelImages(float(t["stamp_s"][at]), left, right)
        return Observation(
            s["stamp_s"], s["q"], s["dq"], s["position_B_P"], s["quat_B_P"], self._wrench[rows], gripper, frame, images
        )

    def _difference(self, command: Command, i: int) -> str:
        """Return how a command differs from the recorded one of cycle i, in words; empty if it does not."""
        c = self._cycles
        was = c["command_q"][i]
        if (command.motion is None) != bool(np.isnan(was[0])):
            return "one holds and the other moves: the record " + ("holds" if np.isnan(was[0]) else "moves")
        if command.motion is not None:
            worst = float(np.abs(command.motion.q - was).max())
            if worst > SAME_RAD:
                return f"a joint setpoint differs by {worst:.2g} rad"
        target, asked = command.gripper, not np.isnan(c["command_aperture_m"][i])
        if (target is not None) != asked:
            return "only one commands the jaws: " + ("the record" if asked else "the replay")
        if target is not None:
            for name, is_, tolerance in (
                ("aperture_m", target.aperture_m, SAME_M),
                ("speed_m_s", target.speed_m_s, SAME_M_S),
                ("force_N", target.force_N, SAME_N),
            ):
                then = float(c[f"command_{name}"][i])
                if abs(is_ - then) > tolerance:
                    return f"the jaws' {name} is {is_:.6g}, it was {then:.6g}"
        if command.tactile != bool(c["command_tactile"][i]):
            return "only one requests depth maps"
        if command.images != (i in self._images_asked):
            return "only one requests gel images"
        return ""


def _row_of(cycles: npt.NDArray[np.int64], i: int) -> int | None:
    """Return the row of a column, of which each row belongs to the cycle in `cycles`, for cycle i."""
    at = int(np.searchsorted(cycles, i))
    return at if at < len(cycles) and cycles[at] == i else None


class _Ticket:
    def __init__(self, robot: ReplayedRobot, done_s: float, error: str | None) -> None:
        self._robot, self._done_s, self._error = robot, done_s, error

    @property
    def done(self) -> bool:
        """True from the recorded time on, half a sample early because stamps are rounded."""
        return self._robot.observe().now_s >= self._done_s - 0.0005

    @property
    def error(self) -> str | None:
        """The recorded error, once done."""
        return self._error if self.done else None
