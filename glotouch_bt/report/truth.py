"""The true outlines of a simulated run's objects in K, from truth.json, for comparison only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.robot import Array, Pose


@dataclass(frozen=True)
class TrueOutline:
    """The true place of one object.

    Attributes:
        name: STL stem.
        start_K_m: (n, 2) outline when the run began, in K.
        end_K_m: (m, 2) outline when it ended, or None.
    """

    name: str
    start_K_m: Array
    end_K_m: Array | None

    @property
    def centre_K_m(self) -> Array:
        """Middle (2,) of the outline's bounding box at the start."""
        return _middle(self.start_K_m)

    def distance_m(self, place_K_m: Array) -> float:
        """Return the distance of a place (2,) from the middle of the outline's bounding box, at the start or the end.

        The nearer one counts: a candidate may be from before the object moved, or from afterwards.
        """
        outlines = [o for o in (self.start_K_m, self.end_K_m) if o is not None]
        return min(float(np.linalg.norm(_middle(outline) - place_K_m)) for outline in outlines)

    @property
    def moved_m(self) -> float:
        """Mean displacement of the outline's corners; 0 if the end is unknown."""
        if self.end_K_m is None or self.end_K_m.shape != self.start_K_m.shape:
            return 0.0
        return float(np.linalg.norm(self.end_K_m - self.start_K_m, axis=1).mean())


def true_outlines(record: RunRecord) -> list[TrueOutline]:
    """Return the objects of truth.json: {start: [...], end: [...]} of {name, outline_B_m}; empty without one."""
    pose, truth = record.pose_B_K, record.truth
    if pose is None or not isinstance(truth, dict):
        return []
    start, end = ({str(o["name"]): _in_K(o["outline_B_m"], pose) for o in truth.get(w) or ()} for w in ("start", "end"))
    return [TrueOutline(name, outline, end.get(name)) for name, outline in start.items()]


def _middle(outline_K_m: Array) -> Array:
    return np.asarray(0.5 * (outline_K_m.min(axis=0) + outline_K_m.max(axis=0)))


def _in_K(outline_B_m: object, pose_B_K: Pose) -> Array:
    p = np.asarray(outline_B_m, dtype=np.float64)[:, :2]
    return pose_B_K.inverse().apply(np.column_stack([p, np.full(len(p), pose_B_K.position_m[2])]))[:, :2]
