"""The 3D view of a record: the container, contacts and contours (foxglove.SceneUpdate, /tf).

Everything is drawn in frame K; the run description's `pose_B_K` places K in B.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from glotouch_bt.mission.record.mcap_json import Json, dumps

Message = tuple[str, bytes]
_EMPTY = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models", "metadata")
_WALL = {"r": 0.45, "g": 0.48, "b": 0.52, "a": 0.35}
_CONTACT = {"r": 0.86, "g": 0.25, "b": 0.16, "a": 1.0}
_CONTOUR = {"r": 0.10, "g": 0.40, "b": 0.78, "a": 1.0}


def container_scene(run: dict[str, Json]) -> Iterator[Message]:
    """Yield the transform of K and the container's walls, if the run description has pose_B_K and interior_m."""
    container = run.get("container")
    inside = container if isinstance(container, dict) else run
    pose = run.get("pose_B_K", inside.get("pose_B_K"))
    interior = inside.get("interior_m", run.get("interior_m"))
    try:
        if isinstance(pose, dict):
            position, quat = _floats(pose["position_m"], 3), _floats(pose["quat"], 4)
            transform = {
                "timestamp": _time(0),
                "parent_frame_id": "B",
                "child_frame_id": "K",
                "translation": _xyz(position),
                "rotation": {"x": quat[1], "y": quat[2], "z": quat[3], "w": quat[0]},
            }
            yield "/tf", dumps({"transforms": [transform]})
        if interior is not None:
            x, y, z = _floats(interior, 3)
            t = 0.002
            walls = [
                _cube((0, 0, -t / 2), (x, y, t)),
                _cube((x / 2 + t / 2, 0, z / 2), (t, y, z)),
                _cube((-x / 2 - t / 2, 0, z / 2), (t, y, z)),
                _cube((0, y / 2 + t / 2, z / 2), (x, t, z)),
                _cube((0, -y / 2 - t / 2, z / 2), (x, t, z)),
            ]
            yield _entity(0, "container", cubes=walls)
    except (KeyError, TypeError, ValueError):
        return  # without usable numbers there is nothing to draw; run.json holds them as given


def event_scene(kind: str, stamp_ns: int, data: Json) -> Iterator[Message]:
    """Yield what a contact or candidate event adds to the view."""
    if not isinstance(data, dict):
        return
    try:
        if kind == "contact":
            contact: Any = data["contact"]
            tip, point = _floats(contact["tip_K_m"], 3), _floats(contact["point_K_m"], 2)
            sphere = {
                "pose": _pose((point[0], point[1], tip[2])),
                "size": {"x": 0.004, "y": 0.004, "z": 0.004},
                "color": _CONTACT,
            }
            yield _entity(stamp_ns, f"contact {stamp_ns}", spheres=[sphere])
        elif kind == "candidate":
            candidate: Any = data["candidate"]
            outline, height = _outline(candidate["contour"]), float(candidate["height_m"])
            line = {
                "type": 0,
                "pose": _pose((0, 0, 0)),
                "thickness": 2.0,
                "scale_invariant": True,
                "points": [_xyz((x, y, height)) for x, y in outline],
                "color": _CONTOUR,
                "colors": [],
                "indices": [],
            }
            centre = _floats(candidate["contour"]["centre_K_m"], 2)
            text = {
                "pose": _pose((centre[0], centre[1], height + 0.02)),
                "billboard": True,
                "font_size": 14.0,
                "scale_invariant": True,
                "color": _CONTOUR,
                "text": f"candidate {candidate['index']}",
            }
            yield _entity(stamp_ns, f"candidate {candidate['index']}", lines=[line], texts=[text])
    except (AttributeError, KeyError, TypeError, ValueError):
        return  # an event of another shape is recorded but not drawn


def _outline(contour: Any) -> list[tuple[float, float]]:
    """Return the closed polyline in K of a recorded contour."""
    if contour.get("family") == "free":
        corners = [_floats(p, 2) for p in contour["boundary_K_m"]]
        if len(corners) < 3:
            raise ValueError(f"{len(corners)} corners of an outline")
        return [(x, y) for x, y in (*corners, corners[0])]
    cx, cy = _floats(contour["centre_K_m"], 2)
    long, short = _floats(contour["size_m"], 2)
    yaw = float(contour["yaw_rad"])
    if contour["kind"] == "round":
        local = [(long / 2 * math.cos(k * math.pi / 16), long / 2 * math.sin(k * math.pi / 16)) for k in range(33)]
    else:
        local = [(sx * long / 2, sy * short / 2) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))]
    c, s = math.cos(yaw), math.sin(yaw)
    return [(cx + c * x - s * y, cy + s * x + c * y) for x, y in local]


def _floats(value: Any, n: int) -> tuple[float, ...]:
    numbers = tuple(float(v) for v in value)
    if len(numbers) != n:
        raise ValueError(f"{len(numbers)} numbers instead of {n}")
    return numbers


def _time(stamp_ns: int) -> dict[str, int]:
    return {"sec": stamp_ns // 10**9, "nsec": stamp_ns % 10**9}


def _xyz(p: tuple[float, ...]) -> dict[str, float]:
    return {"x": p[0], "y": p[1], "z": p[2]}


def _pose(p: tuple[float, ...]) -> dict[str, object]:
    return {"position": _xyz(p), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def _cube(centre: tuple[float, ...], size: tuple[float, ...]) -> dict[str, object]:
    return {"pose": _pose(centre), "size": _xyz(size), "color": _WALL}


def _entity(stamp_ns: int, name: str, **parts: object) -> Message:
    entity = {
        "timestamp": _time(stamp_ns),
        "frame_id": "K",
        "id": name,
        "lifetime": _time(0),
        "frame_locked": True,
        **{key: [] for key in _EMPTY},
        **parts,
    }
    return "/scene", dumps({"deletions": [], "entities": [entity]})
