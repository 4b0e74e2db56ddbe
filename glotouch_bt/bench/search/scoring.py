"""What an exploration found, held against the truth. Planar; frames: K, the container as the robot is told it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from glotouch_bt.bench.planar import FeltSection
from glotouch_bt.perception.touch import ContourKind
from glotouch_bt.robot import Array

DISCOVERED_M = 0.025
"""A candidate is of an object if its centre is this near to the object's."""
ELONGATED = 1.2
"""A felt outline has a yaw if its least rectangle is at least this much longer than wide."""


@dataclass(frozen=True)
class Found:
    """A candidate as it is scored.

    Attributes:
        travel_m: Planar travel when it was added.
        centre_K_m: (2,).
        kind: Of its contour.
        yaw_rad: Of its long side.
        height_m: Of its top above the floor, or None if that was not touched.
    """

    travel_m: float
    centre_K_m: Array
    kind: ContourKind
    yaw_rad: float
    height_m: float | None = None


@dataclass(frozen=True)
class TrueLayout:
    """Objects as they stood before and after the exploration.

    Attributes:
        sections: Felt section of each.
        before, after: (k, 3) x m, y m, yaw rad of their mesh frames in K.
    """

    sections: tuple[FeltSection, ...]
    before: Array
    after: Array

    @property
    def centres_K_m(self) -> Array:
        """(k, 2) true centres afterwards."""
        return np.array([_place(s.centre_m, p) for s, p in zip(self.sections, self.after, strict=True)]).reshape(-1, 2)


def _place(point_m: Array, pose: Array) -> Array:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(np.array([[c, -s], [s, c]]) @ point_m + pose[:2])


def assign(found: Sequence[Found], layout: TrueLayout) -> list[int | None]:
    """For each candidate in order, the nearest object within `DISCOVERED_M` that no earlier one was of; or None."""
    centres = layout.centres_K_m
    left = set(range(len(centres)))
    out: list[int | None] = []
    for f in found:
        near = sorted((float(np.linalg.norm(centres[i] - f.centre_K_m)), i) for i in left)
        if near and near[0][0] <= DISCOVERED_M:
            left.discard(near[0][1])
            out.append(near[0][1])
        else:
            out.append(None)
    return out


def errors(found: Found, i: int, layout: TrueLayout) -> dict[str, Any]:
    """Errors of a candidate of object i against its true place at the end; None where there is nothing to compare."""
    section, after = layout.sections[i], layout.after[i]
    yaw: float | None = None
    if found.kind == "box" and section.elongation >= ELONGATED:
        off = found.yaw_rad - (after[2] + section.box_yaw_rad)
        yaw = float(np.rad2deg(abs((off + 0.5 * np.pi) % np.pi - 0.5 * np.pi)))
    moved = _place(section.centre_m, after) - _place(section.centre_m, layout.before[i])
    return {
        "object": section.name,
        "kind": found.kind,
        "travel_m": found.travel_m,
        "centre_error_mm": 1e3 * float(np.linalg.norm(found.centre_K_m - layout.centres_K_m[i])),
        "height_error_mm": None if found.height_m is None else 1e3 * abs(found.height_m - section.top_m),
        "yaw_error_deg": yaw,
        "displaced_mm": 1e3 * float(np.linalg.norm(moved)),
    }


def score(found: Sequence[Found], layout: TrueLayout, measured: Sequence[Found] | None = None) -> dict[str, Any]:
    """`discovered_m` (travel at each object's discovery), `false_candidates`, and `candidates` (errors of each).

    An object counts as discovered when its candidate was traced; if that was too far off, when it was refined.

    Args:
        found: As they were when traced: this says whose they are.
        layout: The truth.
        measured: As they were at the end, in the same order; the errors are theirs. None: the same.
    """
    final = measured if measured is not None else found
    whose = assign([*found, *final], layout)
    first, later = whose[: len(found)], whose[len(found) :]
    real = [
        (replace(end, travel_m=(f if i is not None else end).travel_m), i if i is not None else j)
        for f, end, i, j in zip(found, final, first, later, strict=True)
    ]
    mine = [(f, i) for f, i in real if i is not None]
    return {
        "discovered_m": sorted(f.travel_m for f, _ in mine),
        "false_candidates": len(found) - len(mine),
        "candidates": [errors(f, i, layout) for f, i in mine],
    }


def discovered_at(row: Mapping[str, Any], travel_m: float) -> int:
    """How many objects a trial had discovered when it had travelled so far."""
    return sum(t <= travel_m for t in row["discovered_m"])
