"""Score an exploration against the truth. Planar, in the container frame K given to the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from glotouch_bt.bench.planar import FeltSection
from glotouch_bt.perception.touch import ContourKind
from glotouch_bt.robot import Array

DISCOVERED_M = 0.025
"""Largest distance between a candidate's centre and its object's."""
ELONGATED = 1.2
"""Least aspect ratio of the minimum-area rectangle for which a yaw is scored."""


@dataclass(frozen=True)
class Found:
    """A candidate to score.

    Attributes:
        travel_m: Planar travel when it was last traced; `known_from_m` is the travel that counts as its discovery.
        centre_K_m: (2,) centre of its contour.
        kind: Kind of its contour.
        yaw_rad: Direction of its long side.
        height_m: Height of its top above the floor; None if not touched.
        earlier: Travel and centre (2,) each time it was traced before, in order.
    """

    travel_m: float
    centre_K_m: Array
    kind: ContourKind
    yaw_rad: float
    height_m: float | None = None
    earlier: tuple[tuple[float, Array], ...] = ()

    def known_from_m(self, place_K_m: Array) -> float:
        """Return the travel from which on its centre is within `DISCOVERED_M` of a place (2,)."""
        travel_m = self.travel_m
        for before_m, centre in reversed(self.earlier):
            if float(np.linalg.norm(centre - place_K_m)) > DISCOVERED_M:
                break
            travel_m = before_m
        return travel_m


@dataclass(frozen=True)
class TrueLayout:
    """True objects before and after the exploration.

    Attributes:
        sections: Probe section of each object.
        before, after: (k, 3) x m, y m, yaw rad of the mesh frames in K.
    """

    sections: tuple[FeltSection, ...]
    before: Array
    after: Array

    @property
    def centres_K_m(self) -> Array:
        """Return the true centres (k, 2) afterwards."""
        return np.array([_place(s.centre_m, p) for s, p in zip(self.sections, self.after, strict=True)]).reshape(-1, 2)


def _place(point_m: Array, pose: Array) -> Array:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(np.array([[c, -s], [s, c]]) @ point_m + pose[:2])


def assign(found: Sequence[Found], layout: TrueLayout) -> list[int | None]:
    """Assign each candidate, in order, the nearest unassigned object within `DISCOVERED_M`, or None."""
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
    """Return the errors of a candidate of object i against its final true pose; None where not defined."""
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
    """Return `discovered_m` (travel at each discovery), `false_candidates`, and `candidates` (errors of each).

    An object is discovered as soon as its candidate lies within `DISCOVERED_M` of it and stays there: when it was
    traced, or when it was refined if the trace was too far off.

    Args:
        found: Candidates when traced; they decide the assignment.
        layout: The truth.
        measured: The same candidates at the end, for the errors; None to use `found`.
    """
    final = measured if measured is not None else found
    whose = assign([*found, *final], layout)
    first, later = whose[: len(found)], whose[len(found) :]
    real = [
        (end, j) if i is None else (replace(end, travel_m=f.travel_m, earlier=f.earlier), i)
        for f, end, i, j in zip(found, final, first, later, strict=True)
    ]
    mine = [(f, i) for f, i in real if i is not None]
    return {
        "discovered_m": sorted(f.known_from_m(layout.centres_K_m[i]) for f, i in mine),
        "false_candidates": len(found) - len(mine),
        "candidates": [errors(f, i, layout) for f, i in mine],
    }


def discovered_at(row: Mapping[str, Any], travel_m: float) -> int:
    """Return the number of objects discovered within `travel_m`."""
    return sum(t <= travel_m for t in row["discovered_m"])
