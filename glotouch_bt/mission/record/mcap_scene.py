"""The 3D view of a record: the container, contacts and contours (foxglove.SceneUpdate), in frame K.

A viewer that jumps to a time gets the last message of each topic: what never changes is one message of its own topic.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from glotouch_bt.mission.record.mcap_json import Json, dumps
from glotouch_bt.robot import GlotouchError, Pose

Message = tuple[str, bytes]
_EMPTY = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models", "metadata")
Json3D = dict[str, Any]
"""Primitives of a foxglove.SceneEntity, or one of them."""


def colour(r: float, g: float, b: float, a: float = 1.0) -> Json3D:
    """Return a foxglove.Color."""
    return {"r": r, "g": g, "b": b, "a": a}


_WALL, _CONTACT, _CONTOUR = colour(0.78, 0.72, 0.62, 0.35), colour(0.86, 0.25, 0.16), colour(0.10, 0.40, 0.78)


def world_scene(run: dict[str, Json], robot: Iterable[tuple[str, Json3D]]) -> Iterator[Message]:
    """Yield one message with the robot's parts, by frame, and the container's walls, if the run describes them."""
    entities = [_entity(0, f"robot {frame}", frame, **parts) for frame, parts in robot]
    container = run.get("container")
    interior = container.get("interior_m") if isinstance(container, dict) else run.get("interior_m")
    try:
        x, y, z = _floats(interior, 3)
        t = 0.002
        boxes = [((0.0, 0.0, -t / 2), (x, y, t))]
        boxes += [((s * (x + t) / 2, 0.0, z / 2), (t, y, z)) for s in (1, -1)]
        boxes += [((0.0, s * (y + t) / 2, z / 2), (x, t, z)) for s in (1, -1)]
        entities.append(_entity(0, "container", cubes=[cube(at, size, _WALL) for at, size in boxes]))
    except (KeyError, TypeError, ValueError):
        pass  # without usable numbers there is nothing to draw; run.json holds them as given
    if entities:
        yield "/scene/world", dumps({"deletions": [], "entities": entities})


def registered_container(run: dict[str, Json]) -> Pose | None:
    """Return the pose of K in B, if the run description has it."""
    container: Any = run.get("container")
    pose: Any = run.get("pose_B_K", container.get("pose_B_K") if isinstance(container, dict) else None)
    try:
        return Pose(np.array(_floats(pose["position_m"], 3)), np.array(_floats(pose["quat"], 4)))
    except (KeyError, TypeError, ValueError, GlotouchError):
        return None


def event_scene(kind: str, stamp_ns: int, data: Json) -> Iterator[Message]:
    """Yield what an event adds to the view (contacts, candidates) or removes from it (forgotten candidates)."""
    if not isinstance(data, dict):
        return
    try:
        if kind == "contact":
            contact: Any = data["contact"]
            tip, point = _floats(contact["tip_K_m"], 3), _floats(contact["point_K_m"], 2)
            ball = sphere((point[0], point[1], tip[2]), 0.002, _CONTACT)
            yield _update(_entity(stamp_ns, f"contact {stamp_ns}", spheres=[ball]))
        elif kind == "candidate":
            candidate: Any = data["candidate"]
            outline, height = _outline(candidate["contour"]), float(candidate["height_m"])
            line = {
                "type": 0,
                "pose": pose_json((0, 0, 0)),
                "thickness": 2.0,
                "scale_invariant": True,
                "points": [_xyz((x, y, height)) for x, y in outline],
                "color": _CONTOUR,
                "colors": [],
                "indices": [],
            }
            centre = _floats(candidate["contour"]["centre_K_m"], 2)
            text = {
                "pose": pose_json((centre[0], centre[1], height + 0.02)),
                "billboard": True,
                "font_size": 14.0,
                "scale_invariant": True,
                "color": _CONTOUR,
                "text": f"candidate {candidate['index']}",
            }
            yield _update(_entity(stamp_ns, f"candidate {candidate['index']}", lines=[line], texts=[text]))
        elif kind == "forgotten":
            forgotten: Any = data["candidates"]
            gone = [{"timestamp": _time(stamp_ns), "type": 0, "id": f"candidate {int(i)}"} for i in forgotten]
            yield "/scene", dumps({"deletions": gone, "entities": []})
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


def pose_json(p: tuple[float, ...], quat: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> Json3D:
    """Return a foxglove.Pose of a position and a rotation w x y z."""
    w, x, y, z = quat
    return {"position": _xyz(p), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def cube(centre: tuple[float, ...], size: tuple[float, ...], shade: Json3D) -> Json3D:
    """Return a foxglove.CubePrimitive."""
    return {"pose": pose_json(centre), "size": _xyz(size), "color": shade}


def sphere(centre: tuple[float, ...], radius: float, shade: Json3D) -> Json3D:
    """Return a foxglove.SpherePrimitive."""
    return {"pose": pose_json(centre), "size": _xyz((2.0 * radius,) * 3), "color": shade}


def _entity(stamp_ns: int, name: str, frame: str = "K", **parts: object) -> Json3D:
    fixed = {"timestamp": _time(stamp_ns), "frame_id": frame, "id": name, "lifetime": _time(0), "frame_locked": True}
    return fixed | {key: [] for key in _EMPTY} | parts


def _update(entity: Json3D) -> Message:
    return "/scene", dumps({"deletions": [], "entities": [entity]})
