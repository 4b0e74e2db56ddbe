"""The true outlines of a simulated run's objects in K, from truth.json, for comparison only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.robot import Array


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
        return np.asarray(0.5 * (self.start_K_m.min(axis=0) + self.start_K_m.max(axis=0)))

    @property
    def moved_m(self) -> float:
        """Mean displacement of the outline's corners; 0 if the end is unknown."""
        if self.end_K_m is None or self.end_K_m.shape != self.start_K_m.shape:
            return 0.0
        return float(np.linalg.norm(self.end_K_m - self.start_K_m, axis=1).mean())


def true_outlines(record: RunRecord) -> list[TrueOutline]:
    """Return the objects of truth.json.

    It is a list of {name, outline_B_m: {start, end}}; `outline_B_m` as a bare list is the start, and
    {start: [...], end: [...]} with a list of objects each is accepted, too. Unreadable entries are left out.
    """
    pose = record.pose_B_K
    if pose is None:
        return []
    K_B = pose.inverse()
    truth = record.truth
    if isinstance(truth, dict) and isinstance(truth.get("objects"), list | dict):
        truth = truth["objects"]
    ends: dict[str, Any] = {}
    if isinstance(truth, dict):
        late = truth.get("end")
        ends = {str(o.get("name")): o for o in late if isinstance(o, dict)} if isinstance(late, list) else {}
        truth = truth.get("start")
    out: list[TrueOutline] = []
    for item in truth if isinstance(truth, list) else []:
        if not isinstance(item, dict):
            continue
        name = str(item.get("name", "object"))
        start = _polygon(item, "start")
        end = _polygon(ends[name], "end") if name in ends else _polygon(item, "end", bare=False)
        if start is not None:
            in_K = [
                None if p is None else K_B.apply(np.column_stack([p, np.full(len(p), pose.position_m[2])]))[:, :2]
                for p in (start, end)
            ]
            assert in_K[0] is not None
            out.append(TrueOutline(name, in_K[0], in_K[1]))
    return out


def _polygon(item: dict[str, Any], when: str, bare: bool = True) -> Array | None:
    """Return the outline (n, 2) in B of one object, from any of the accepted forms."""
    both = item.get("outline_B_m")
    nested = item.get(when)
    candidates = [
        both.get(when) if isinstance(both, dict) else None,
        item.get(f"outline_{when}_B_m"),
        item.get(f"outline_B_m_{when}"),
        nested.get("outline_B_m") if isinstance(nested, dict) else None,
        both if bare and isinstance(both, list) else None,
    ]
    for value in candidates:
        if value is None:
            continue
        try:
            p = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            continue
        if p.ndim == 2 and len(p) >= 3 and p.shape[1] >= 2 and np.isfinite(p).all():
            return p[:, :2]
    return None
