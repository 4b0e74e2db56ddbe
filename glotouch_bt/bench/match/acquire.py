"""Acquire TouchSets: run a mission that squeezes every candidate, read its record and label it with the truth."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from glotouch_bt.bench.match.dataset import Layout, Planar, Touched, write_layout
from glotouch_bt.campaign import launch_trial
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.report import RunRecord, read_run
from glotouch_bt.robot import Array, BadInput, Pose
from glotouch_bt.runs import RunRequest

NEAREST_M = 0.025
"""A candidate whose contour centre is farther than this from every object's centre belongs to no object."""


@dataclass(frozen=True)
class TrueStand:
    """Pose of one object at the start and the end: (x, y, yaw) in K, and its tilt at the end."""

    name: str
    start: Planar
    end: Planar
    tilt_rad: float


def acquire_layout(request: RunRequest, dataset: Path) -> Layout:
    """Run the mission, write the layout's files and return the layout. A failed mission keeps the TouchSets it made.

    Raises:
        BadInput: The request is wrong, or the backend has no referee.
        BackendError: The backend did not open.
    """
    done = launch_trial(request)
    layout = layout_of(read_run(done.folder))
    write_layout(dataset, layout)
    return layout


def layout_of(record: RunRecord) -> Layout:
    """Return the labelled TouchSets of a recorded run. Depth maps are exact to the record's micrometre.

    TouchSets without a stable closure are left out, because `match` never receives them.

    Raises:
        BadInput: The record has no truth beside it.
    """
    pose_B_K = record.pose_B_K
    if record.truth is None or pose_B_K is None:
        raise BadInput(f"{record.path}: no truth is written beside this record; only a simulation can be labelled")
    stands = true_stands(record.truth, pose_B_K)
    last = {e.data["touchset"]["candidate"]["index"]: e.data["touchset"] for e in record.of_kind("touchset")}
    touchsets: list[TouchSet] = [from_json(TouchSet, data) for data in last.values()]
    felt = [label(t, stands) for t in touchsets if any(layer.stable for layer in t.layers)]
    chain = record.result.get("reason_chain") or []
    status = str(record.result.get("status", "aborted"))
    ended = status if status == "success" or not chain else str(chain[-1].get("code") or status)
    return Layout(
        int(record.run["seed"]), str(record.result.get("conditions", "")), tuple(s.name for s in stands), tuple(felt),
        ended, float(record.result.get("sim_time_s", float("nan"))),
    )  # fmt: skip


def label(touchset: TouchSet, stands: list[TrueStand]) -> Touched:
    """Label a TouchSet with the nearest object, at its first or last pose; None beyond `NEAREST_M`."""
    centre = np.asarray(touchset.candidate.contour.centre_K_m)
    gaps = [min(float(np.hypot(*(centre - p[:2]))) for p in (s.start, s.end)) for s in stands]
    if not gaps or min(gaps) > NEAREST_M:
        return Touched(touchset, None)
    s = stands[int(np.argmin(gaps))]
    return Touched(touchset, s.name, s.end, s.tilt_rad)


def true_stands(truth: Mapping[str, Any], pose_B_K: Pose) -> list[TrueStand]:
    """Return the objects of a truth.json in the container frame given to the robot."""
    to_K = pose_B_K.inverse()

    def in_K(entry: Mapping[str, Any]) -> Pose:
        p = entry["pose_B_O"]
        return to_K @ Pose(np.array(p["position_m"], dtype=np.float64), np.array(p["quat"], dtype=np.float64))

    ends = {o["name"]: in_K(o) for o in truth["end"]}
    return [
        TrueStand(o["name"], _planar(in_K(o)), _planar(ends[o["name"]]), _tilt(ends[o["name"]])) for o in truth["start"]
    ]


def _planar(pose: Pose) -> Planar:
    return float(pose.position_m[0]), float(pose.position_m[1]), float(pose.yaw_rad)


def _tilt(pose: Pose) -> float:
    up: Array = pose.apply(np.array([0.0, 0.0, 1.0])) - pose.position_m
    return float(np.arccos(np.clip(up[2], -1.0, 1.0)))


def from_json(hint: Any, value: Any) -> Any:
    """Convert recorded JSON back to a value: the inverse of `record.to_json`, guided by the type.

    Args:
        hint: A dataclass, or the type of one of its fields.
        value: Plain JSON; null means NaN where a number is expected. Unknown keys are ignored.
    """
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        hints = get_type_hints(hint)
        given = {
            f.name: value[f.name] for f in dataclasses.fields(hint) if f.name in value and not _is_default(f, value)
        }
        return hint(**{name: from_json(hints[name], v) for name, v in given.items()})
    origin, args = get_origin(hint), get_args(hint)
    if origin is tuple:
        kinds = [args[0]] * len(value) if args[-1] is Ellipsis else list(args)
        return tuple(from_json(k, v) for k, v in zip(kinds, value, strict=True))
    if hint is float:
        return float("nan") if value is None else float(value)
    if origin is np.ndarray:
        return np.array(value, dtype=np.float64)
    if origin in (types.UnionType, Union) and value is not None and len(args) == 2:
        return from_json(args[0], value)
    return value


def _is_default(field: dataclasses.Field[Any], value: Mapping[str, Any]) -> bool:
    """Tell an empty array field from one with data: an empty list has no shape, the default has."""
    return value[field.name] == [] and field.default_factory is not dataclasses.MISSING
