"""Leave resting objects that nothing can reach out of MuJoCo's collision detection.

In every step MuJoCo computes a bounding box of each geom that can collide, asleep or not. An object has about forty
geoms, a fifth of a step's time for five objects. A sleeping object that nothing comes near has no contacts, so a body
whose categories are zero for a period gives the same contacts, and the same motion to the bit.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_backends.mujoco.model import Handles
from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array

Ints = npt.NDArray[np.int32]

GAP_M = 0.003
"""Distance to which a body counts as reached, beyond its own motion. Source: ours; larger than any contact margin."""
MOTIONS = 2.0
"""Distance to which a body counts as reached, over its motion in the last period: it may speed up, and what it hits
may leave it faster than it came. Whatever is faster touches one period late. Source: ours."""


@compiled(
    "i4[::1]",
    "i4[::1]",
    "i4[:, ::1]",
    "i4[::1]",
    "i8[:, ::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[::1]",
    "f8[::1]",
    "f8[:, ::1]",
    "i8",
)
def _leave_out(
    contype: Ints,
    conaffinity: Ints,
    categories: Ints,
    awake: Ints,
    bodies: npt.NDArray[np.int64],
    boxes: Array,
    xpos: Array,
    xmat: Array,
    last: Array,
    spans: Array,
    qpos: Array,
    qvel: Array,
    forces: Array,
    objects: int,
) -> None:
    """Set the categories of the objects' bodies: zero for those at rest out of reach.

    Args:
        contype, conaffinity: (nbody,) of the model.
        categories: (objects, 2) of the objects' bodies as compiled.
        awake: (nbody,) state of each body.
        bodies: (n, 3) id, first qpos and first dof of each object, then the ids of all other moving bodies.
        boxes: (n, 6) centre and half sizes of each body's box, in its frame.
        xpos, xmat, qpos, qvel, forces: Of mjData, `forces` is xfrc_applied.
        last: (objects, 7) qpos of each object at the last call; updated.
        spans: (n, 6) lowest and highest corner of each body's box in B at the last call; updated.
        objects: Number of objects.
    """
    n = len(bodies)
    reach = np.zeros(n)
    near = np.zeros(n, dtype=np.bool_)
    near[objects:] = True
    for b in range(n):
        body, moved = bodies[b, 0], 0.0
        for i in range(3):
            centre, half = xpos[body, i], 0.0
            for j in range(3):
                centre += xmat[body, 3 * i + j] * boxes[b, j]
                half += abs(xmat[body, 3 * i + j]) * boxes[b, 3 + j]
            moved = max(moved, abs(centre - half - spans[b, i]), abs(centre + half - spans[b, 3 + i]))
            spans[b, i], spans[b, 3 + i] = centre - half, centre + half
        reach[b] = GAP_M + MOTIONS * moved
    for b in range(objects):
        body, at, dof = bodies[b, 0], bodies[b, 1], bodies[b, 2]
        near[b] = awake[body] != 0
        for i in range(7):
            near[b] |= qpos[at + i] != last[b, i]  # a fault has moved it: MuJoCo wakes it in the next step
            last[b, i] = qpos[at + i]
        for i in range(6):
            near[b] |= qvel[dof + i] != 0.0 or forces[body, i] != 0.0
    for _ in range(objects):  # what is near something that may be pushed may be pushed too
        for a in range(objects):
            for b in range(n):
                if near[b] and not near[a]:
                    near[a] = True
                    for i in range(3):
                        near[a] &= spans[a, i] < spans[b, 3 + i] + reach[b] and spans[b, i] < spans[a, 3 + i] + reach[b]
                    if near[a]:
                        reach[a] = max(reach[a], reach[b])  # what it is hit by may move it as fast
    for b in range(objects):
        body = bodies[b, 0]
        contype[body] = categories[b, 0] if near[b] else 0
        conaffinity[body] = categories[b, 1] if near[b] else 0


@compiled("i4[::1]", "i4[::1]", "i4[:, ::1]", "i8[:, ::1]")
def _take_in(contype: Ints, conaffinity: Ints, categories: Ints, bodies: npt.NDArray[np.int64]) -> None:
    """Set the objects' bodies to their `categories`; arguments as of `_leave_out`."""
    for b in range(len(categories)):
        contype[bodies[b, 0]], conaffinity[bodies[b, 0]] = categories[b, 0], categories[b, 1]


def _box(model: mujoco.MjModel, body: int) -> Array:
    """Return centre and half sizes (6,) of a box around a body's geoms that collide, in the body's frame."""
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    rotation = np.zeros(9)
    for geom in range(first, first + count):
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
            turned = rotation.reshape(3, 3)
            centre = model.geom_pos[geom] + turned @ model.geom_aabb[geom, :3]
            half = np.abs(turned) @ model.geom_aabb[geom, 3:]
            low, high = np.minimum(low, centre - half), np.maximum(high, centre + half)
    return np.concatenate([0.5 * (low + high), 0.5 * (high - low)])


class RestingObjects:
    """Context of a control period's steps, in which objects at rest are left out of the collision detection.

    Args:
        model, data: The world.
        handles: Its indices.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, handles: Handles) -> None:
        free = [b for b in handles.object_bodies if model.body_jntadr[b] >= 0]
        collides = (model.body_contype != 0) | (model.body_conaffinity != 0)
        moving = np.flatnonzero(collides & (model.body_weldid != 0))
        others = [int(b) for b in moving if b not in handles.object_bodies]
        joints = [int(model.body_jntadr[b]) for b in free]
        places = [(b, int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])) for b, j in zip(free, joints, strict=True)]
        self._bodies = np.array([*places, *((b, 0, 0) for b in others)], dtype=np.int64)
        boxes = np.array([_box(model, b) for b in (*free, *others)])
        kinds = np.stack([model.body_contype[free], model.body_conaffinity[free]], axis=1)
        self._categories = model.body_contype, model.body_conaffinity, kinds
        last: Array = np.full((len(free), 7), np.nan)
        spans: Array = np.full((len(self._bodies), 6), np.inf)  # at first everything is near
        now = data.xpos, data.xmat, last, spans, data.qpos, data.qvel, data.xfrc_applied
        self._all = *self._categories, data.body_awake, self._bodies, boxes, *now, len(free)

    def __enter__(self) -> None:
        """Leave the resting objects out for a period that nothing can reach in it."""
        _leave_out(*self._all)

    def __exit__(self, *_: object) -> None:
        """Take all objects in again: between two periods the model is the compiled one."""
        _take_in(*self._categories, self._bodies)
