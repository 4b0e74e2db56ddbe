"""The run as data for scene.js, which plays it in the browser: solids once, motion at 10 Hz, and what was known when.

Lengths of meshes are in steps of `STEP_M`, everything else in metres. Matrices are 4 x 4, column by column.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.scene import shapes
from glotouch_bt.report.state import (
    CandidateOutline,
    GhostObject,
    GrowingRows,
    PlannedGrasp,
    RunModel,
    RunSetup,
    SceneState,
    true_bodies,
)
from glotouch_bt.robot import Array, Pose, RobotDescription

STEP_M = 5e-5
"""Step of vertices. Source: ours; 16 bits reach 1.6 m."""
RATE_HZ = 10.0
"""Rate of the motion. Source: ours; a probe motion of 0.1 m takes a second, and the page interpolates."""
MAX_FRAMES = 20_000
"""Maximum number of frames; longer runs are shown at a lower rate. Source: ours, 0.5 MB of the page."""
JOINT_RAD, JAW_M, FORCE_N = 2e-4, 1e-5, 0.01
"""Steps of joint positions (up to 6.5 rad), jaw opening and force."""
SECTIONS = 18
"""Corners of a drawn circle."""
CELLS = 30
"""Corners of an object's mesh are merged within 1 / CELLS of its size."""
MAX_FELT = 160
"""Maximum number of taxels drawn of one closure."""
MAX_KEYS = 600
"""Maximum number of times at which something became known."""
KEYED = frozenset(
    {"candidate", "touchset", "top", "next_probe", "closure", "decided", "ranking", "plan", "lift", "put_back"}
    | {"reject", "tool", "failure"}
)
"""Events that may change the scene beside motion and contacts."""
_SCRIPT = Path(__file__).with_name("scene.js")


def script() -> str:
    """Return the program of the scene, the only one of the report."""
    return _SCRIPT.read_text(encoding="utf-8")


def scene_data(record: RunRecord, setup: RunSetup) -> dict[str, Any] | None:
    """Return the data of a run's scene, or None without a robot's description or motion."""
    model = RunModel.of(record)
    if setup.description is None or model.motion is None or len(model.motion.rows) < 2:
        return None
    start_s, end_s = model.span_s
    rate = min(RATE_HZ, MAX_FRAMES / max(end_s - start_s, 1e-9))
    at = np.arange(start_s, end_s + 1.0 / rate, 1.0 / rate)
    outlines: dict[int, int] = {}
    drawn: list[dict[str, Any]] = []
    keys = []
    for t_s in _key_times(record, start_s, end_s):
        state = model.state_at(t_s)
        for o in state.outlines:
            if id(o) not in outlines:
                outlines[id(o)] = len(drawn)
                drawn.append(_outline(o))
        keys.append(_key(state, outlines))
    final = model.state_at(end_s)
    fits = {id(k["fit"]): k["fit"] for k in keys if k["fit"] is not None}
    for fit in fits.values():
        fit["solid"] = _fitted(fit.pop("target"), setup)
    return {
        "step": STEP_M,
        "start": round(start_s, 3),
        "rate": rate,
        "motion": _motion(model.motion, model.jaws, at),
        "robot": _robot(setup.description),
        "K": _matrix(setup.pose_B_K),
        "stand": None if setup.holder is None else _matrix(setup.holder.pose_B_grasp),
        "probe": 0.0 if setup.probe is None else setup.probe.grasp_to_tip_m,
        "solids": [_solid(s) for s in _solids(setup, setup.description)],
        "rim": _rounded(shapes.rim(setup)),
        "touches": [[round(t.stamp_s, 2), *_rounded(t.point_K_m), *_rounded(t.outward_K)] for t in final.touches],
        "felt": [_felt(p.points_K_m) for p in final.patches],
        "outlines": drawn,
        "keys": keys,
        "ghosts": _ghosts(record, setup),
        "skills": _skills(record),
        "colours": {name: list(c) for name, c in shapes.STATE_COLOURS.items()}
        | {
            "touch": list(shapes.TOUCH),
            "plan": list(shapes.PLAN),
            "ghost": list(shapes.GHOST),
            "fit": list(shapes.FIT),
        },
        "sizes": [shapes.TOUCH_RADIUS_M, shapes.REACTION_M],
    }


def scene_json(data: Mapping[str, Any]) -> str:
    """Return the data as JSON that can stand inside an element of a page."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _key_times(record: RunRecord, start_s: float, end_s: float) -> list[float]:
    times = sorted({round(e.stamp_s, 4) for e in record.events if e.kind in KEYED and start_s <= e.stamp_s <= end_s})
    step = -(-len(times) // MAX_KEYS) or 1
    return [start_s, *times[::step], *times[-1:]]


def _key(state: SceneState, outlines: Mapping[int, int]) -> dict[str, Any]:
    shares = {str(s.index): round(s.probability, 4) for s in state.shares}
    return {
        "t": round(state.t_s, 3),
        "outlines": [outlines[id(o)] for o in state.outlines],
        "states": {str(i): word for i, word in state.states.items()},
        "shares": shares,
        "grasp": None if state.grasp is None else _grasp(state.grasp),
        "fit": None if state.fit is None else {"target": state.fit},
        "tip": state.tip_m,
        "lost": state.probe_lost,
        "felt": len(state.patches),
    }


def _grasp(grasp: PlannedGrasp) -> dict[str, Any]:
    pose = Pose.pointing_down(grasp.position_K_m, grasp.yaw_rad)
    return {"at": _matrix(pose), "opening": grasp.opening_m}


def _outline(o: CandidateOutline) -> dict[str, Any]:
    across = np.maximum(shapes.SDS * o.sd_m, shapes.MIN_BAND_M)[:, None] * o.normal_K
    height = max(o.height_m, shapes.MIN_HEIGHT_M)
    return {"i": o.index, "at": _rounded(o.outline_K_m), "across": _rounded(across, 5), "height": round(height, 4)}


def _solids(setup: RunSetup, description: RobotDescription) -> Iterable[shapes.Solid]:
    yield from shapes.world_solids(setup)
    yield from shapes.robot_solids(description, SECTIONS)
    if setup.probe is not None:
        yield from shapes.probe_solids(setup.probe)


def _solid(s: shapes.Solid) -> dict[str, Any]:
    return _mesh(s.vertices_m, s.faces, smooth=s.smooth) | {
        "frame": s.frame.rsplit("/", 1)[-1] if s.frame.startswith("arm/") else s.frame,
        "colour": list(s.colour),
        "opacity": s.opacity,
    }


def _mesh(vertices_m: Array, faces: npt.NDArray[np.int64], *, smooth: bool) -> dict[str, Any]:
    v = np.clip(np.rint(vertices_m / STEP_M), -32767, 32767).astype("<i2")
    return {"v": _base64(v), "f": _base64(faces.astype("<u2")), "smooth": smooth}


def _coarse(vertices_m: Array, faces: npt.NDArray[np.int64]) -> dict[str, Any]:
    """Return a mesh with its corners merged within cells; what collapses is left out."""
    cell = float(np.ptp(vertices_m, axis=0).max()) / CELLS
    _, first, of = np.unique(
        np.rint(vertices_m / cell).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    of = of.ravel()
    count = np.bincount(of, minlength=len(first))[:, None]
    merged = np.stack([np.bincount(of, vertices_m[:, k], minlength=len(first)) for k in range(3)], axis=1) / count
    corners = of[faces]
    kept = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return _mesh(merged, np.unique(corners[kept], axis=0), smooth=True)


def _fitted(fit: Any, setup: RunSetup) -> dict[str, Any] | None:
    found = shapes.fitted_mesh(fit, setup)
    return None if found is None else _coarse(*found)


def _ghosts(record: RunRecord, setup: RunSetup) -> list[dict[str, Any]]:
    """Return the true objects of a simulation: their meshes, and where they were at the start and at the end."""
    truth = record.truth if isinstance(record.truth, dict) else {}
    start, end = ({b.name: b for b in true_bodies(truth.get(when))} for when in ("start", "end"))
    out = []
    for name, body in start.items():
        found = shapes.true_mesh(body, setup)
        if found is not None:
            places = [_body(body), _body(end.get(name, body))]
            out.append({"name": name, "solid": _coarse(*found), "at": places})
    return out


def _body(body: GhostObject) -> list[float]:
    return _matrix(Pose(body.position_B_m, body.quat))


def _robot(description: RobotDescription) -> dict[str, Any]:
    zero = shapes.joint_poses(description, np.zeros(description.dof))
    return {
        "joints": [
            {"at": _matrix(pose), "axis": list(j.axis)} for pose, j in zip(zero, description.joints, strict=True)
        ],
        "E": _matrix(description.pose_last_E),
        "P": _matrix(description.gripper.pose_E_P),
    }


def _motion(motion: GrowingRows, jaws: GrowingRows, at_s: Array) -> dict[str, Any]:
    rows = motion.rows
    last = np.clip(np.searchsorted(rows[:, 0], at_s + 1e-9, side="right") - 1, 0, len(rows) - 1)
    first = np.concatenate([[0], last[:-1]])
    force = np.maximum.reduceat(rows[:, 1], np.minimum(first, len(rows) - 1))
    jaw = np.zeros(len(at_s))
    if len(jaws.rows):
        jaw = jaws.rows[np.clip(np.searchsorted(jaws.rows[:, 0], at_s + 1e-9, side="right") - 1, 0, None), 1]
    q = np.clip(np.rint(np.nan_to_num(rows[last, 2:]) / JOINT_RAD), -32767, 32767)
    return {
        "q": _base64(q.astype("<i2")),
        "jaw": _base64(np.clip(np.rint(jaw / JAW_M), 0, 65535).astype("<u2")),
        "force": _base64(np.clip(np.rint(force / FORCE_N), 0, 65535).astype("<u2")),
        "steps": [JOINT_RAD, JAW_M, FORCE_N],
    }


def _felt(points_K_m: Array) -> str:
    spread = points_K_m[:: -(-len(points_K_m) // MAX_FELT) or 1]
    return _base64(np.clip(np.rint(spread / STEP_M), -32767, 32767).astype("<i2"))


def _skills(record: RunRecord) -> list[list[Any]]:
    """Return the stamps at which a leaf of the tree started, with its name."""
    parents = {n.rsplit("/", 1)[0] for n in {t.node for t in record.ticks} if "/" in n}
    started = [t for t in record.ticks if t.new == "RUNNING" and t.node not in parents]
    return [[round(t.stamp_s, 2), t.node.rsplit("/", 1)[-1]] for t in started]


def _matrix(pose: Pose) -> list[float]:
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = pose.rotation, pose.position_m
    return [round(v, 6) for v in m.T.ravel().tolist()]


def _rounded(values: Array, digits: int = 4) -> Any:
    return np.round(values, digits).tolist()


def _base64(values: npt.NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
