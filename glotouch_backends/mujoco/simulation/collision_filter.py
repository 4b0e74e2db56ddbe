"""Leave bodies that can touch nothing in a control period out of MuJoCo's collision detection.

In every step MuJoCo computes a bounding box of each geom that can collide, asleep or not, and sorts all of them. For
five objects of forty geoms and an arm this is about a fifth of a step's time. A body that nothing comes near has no
contacts, so a body whose categories are zero for a period gives the same contacts, and the same motion to the bit. The
pads and the probe's handle touch in contact pairs of their own, which have no categories.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_backends.mujoco.model import Handles
from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array

Ints = npt.NDArray[np.int32]
Indices = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

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
    "i8[::1]",
    "b1[:, ::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "i8[::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[:, :, ::1]",
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
    moving: Indices,
    bodies: Indices,
    collide: Bools,
    boxes: Array,
    fixed: Array,
    owners: Indices,
    xpos: Array,
    xmat: Array,
    last: Array,
    frames: Array,
    qpos: Array,
    qvel: Array,
    forces: Array,
    objects: int,
) -> None:
    """Set the categories of all bodies: zero for those that can touch nothing.

    Args:
        contype, conaffinity: (nbody,) of the model.
        categories: (k, 2) of `bodies` as compiled.
        awake: (nbody,) state of each body.
        moving: (n, 3) id, first qpos and first dof of each object, then the ids of all other moving bodies.
        bodies: (k,) ids of the moving bodies, then of the fixed ones.
        collide: (n, k) True where MuJoCo looks for contacts of two bodies.
        boxes: (n, 6) centre and half sizes of each moving body's box, in its frame.
        fixed: (m, 6) lowest and highest corner of each fixed geom's box in B.
        owners: (m,) index of its body in `bodies`.
        xpos, xmat, qpos, qvel, forces: Of mjData, `forces` is xfrc_applied.
        last: (objects, 7) qpos of each object at the last call; updated.
        frames: (n, 4, 3) centre of each moving body's box in B at the last call, and the vectors from it to the middles
            of three faces; updated.
        objects: Number of objects.
    """
    n = len(moving)
    reach, spans = np.zeros(n), np.zeros((n, 6))  # lowest and highest corner of each box in B
    near = np.zeros(n, dtype=np.bool_)  # objects that may move in this period, and everything else that moves
    near[objects:] = True
    for b in range(n):
        body, moved = moving[b, 0], 0.0
        for i in range(3):
            centre, half, way = xpos[body, i], 0.0, 0.0
            for j in range(3):
                centre += xmat[body, 3 * i + j] * boxes[b, j]
                side = xmat[body, 3 * i + j] * boxes[b, 3 + j]
                half += abs(side)
                way += abs(side - frames[b, 1 + j, i])
                frames[b, 1 + j, i] = side
            moved = max(moved, way + abs(centre - frames[b, 0, i]))  # of any point of the box
            frames[b, 0, i] = centre
            spans[b, i], spans[b, 3 + i] = centre - half, centre + half
        reach[b] = GAP_M + MOTIONS * moved
    # Distance of two boxes along the axis of B along which it is largest; if it is small, also along the boxes' axes.
    gaps = np.full((n, n), np.inf)
    for a in range(n):
        for b in range(a + 1, n):
            if collide[a, b]:
                gaps[a, b] = -np.inf
                for i in range(3):
                    gaps[a, b] = max(gaps[a, b], spans[a, i] - spans[b, 3 + i], spans[b, i] - spans[a, 3 + i])
                if gaps[a, b] < reach[a] + reach[b]:
                    for c in range(6):
                        owner, axis = (a, c) if c < 3 else (b, c - 3)
                        other, apart, half = a + b - owner, 0.0, 0.0
                        for i in range(3):
                            apart += xmat[moving[owner, 0], 3 * i + axis] * (frames[a, 0, i] - frames[b, 0, i])
                        for j in range(3):
                            along = 0.0
                            for i in range(3):
                                along += xmat[moving[owner, 0], 3 * i + axis] * frames[other, 1 + j, i]
                            half += abs(along)
                        gaps[a, b] = max(gaps[a, b], abs(apart) - half - boxes[owner, 3 + axis])
            gaps[b, a] = gaps[a, b]
    for b in range(objects):
        body, at, dof = moving[b, 0], moving[b, 1], moving[b, 2]
        near[b] = awake[body] != 0
        for i in range(7):
            near[b] |= qpos[at + i] != last[b, i]  # a fault has moved it: MuJoCo wakes it in the next step
            last[b, i] = qpos[at + i]
        for i in range(6):
            near[b] |= qvel[dof + i] != 0.0 or forces[body, i] != 0.0
    for _ in range(objects):  # what is near something that may be pushed may be pushed too
        for a in range(objects):
            for b in range(n):
                if near[b] and not near[a] and gaps[a, b] < reach[b]:
                    near[a] = True
                    reach[a] = max(reach[a], reach[b])  # what it is hit by may move it as fast
    touches = np.zeros(len(bodies), dtype=np.bool_)
    for a in range(n):
        if near[a]:
            for b in range(a + 1, n):
                if near[b] and collide[a, b] and gaps[a, b] <= reach[a] + reach[b]:
                    touches[a] = touches[b] = True
            for g in range(len(fixed)):
                if collide[a, owners[g]] and not (touches[a] and touches[owners[g]]):
                    apart = False
                    for i in range(3):
                        apart |= spans[a, i] > fixed[g, 3 + i] + reach[a] or fixed[g, i] > spans[a, 3 + i] + reach[a]
                    if not apart:
                        touches[a] = touches[owners[g]] = True
    for b in range(len(bodies)):
        contype[bodies[b]] = categories[b, 0] if touches[b] else 0
        conaffinity[bodies[b]] = categories[b, 1] if touches[b] else 0


def _box(model: mujoco.MjModel, geom: int, position: Array, rotation: Array) -> Array:
    """Return the lowest and the highest corner (6,) of a geom's box in a frame in which its pose is given."""
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:  # a half space: bounded only along an axis of the frame
        normal = rotation[:, 2]
        return np.concatenate([np.where(normal == -1.0, position, -np.inf), np.where(normal == 1.0, position, np.inf)])
    centre = position + rotation @ model.geom_aabb[geom, :3]
    half = np.abs(rotation) @ model.geom_aabb[geom, 3:]
    return np.concatenate([centre - half, centre + half])


def _colliding(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the geoms of a body that can collide."""
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    return [g for g in range(first, first + count) if model.geom_contype[g] or model.geom_conaffinity[g]]


def _body_box(model: mujoco.MjModel, body: int) -> Array:
    """Return centre and half sizes (6,) of a box around a body's geoms that collide, in the body's frame."""
    boxes, rotation = [], np.zeros(9)
    for geom in _colliding(model, body):
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        boxes.append(_box(model, geom, model.geom_pos[geom], rotation.reshape(3, 3)))
    low, high = np.min(boxes, axis=0)[:3], np.max(boxes, axis=0)[3:]
    return np.concatenate([0.5 * (low + high), 0.5 * (high - low)])


def _looks_for_contacts(model: mujoco.MjModel, a: int, b: int) -> bool:
    """Return True if MuJoCo looks for contacts of two bodies: their categories match, and neither carries the other."""
    one, two = int(model.body_weldid[a]), int(model.body_weldid[b])
    parents = [int(model.body_weldid[model.body_parentid[w]]) for w in (one, two)]
    if one == two or (one and parents[1] == one) or (two and parents[0] == two):
        return False
    types, affinities = model.body_contype, model.body_conaffinity
    return bool(types[a] & affinities[b] or types[b] & affinities[a])


class CollisionFilter:
    """Context of a control period's steps, in which bodies that can touch nothing are left out.

    Args:
        model, data: The world; `data` has been through `mj_forward`.
        handles: Its indices.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, handles: Handles) -> None:
        free = [b for b in handles.object_bodies if model.body_jntadr[b] >= 0]
        collides = [int(b) for b in np.flatnonzero((model.body_contype != 0) | (model.body_conaffinity != 0))]
        others = [b for b in collides if model.body_weldid[b] != 0 and b not in handles.object_bodies]
        still = [b for b in collides if model.body_weldid[b] == 0]
        joints = [int(model.body_jntadr[b]) for b in free]
        places = [(b, int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])) for b, j in zip(free, joints, strict=True)]
        moving = np.array([*places, *((b, 0, 0) for b in others)], dtype=np.int64)
        bodies = np.array([*free, *others, *still], dtype=np.int64)
        collide = np.array([[_looks_for_contacts(model, a, b) for b in bodies] for a in (*free, *others)])
        boxes = np.array([_body_box(model, b) for b in (*free, *others)])
        geoms = [(g, len(moving) + i) for i, b in enumerate(still) for g in _colliding(model, b)]
        poses = [(g, data.geom_xpos[g], data.geom_xmat[g].reshape(3, 3)) for g, _ in geoms]
        fixed = np.array([_box(model, *pose) for pose in poses]).reshape(-1, 6)
        owners = np.array([i for _, i in geoms], dtype=np.int64)
        kinds = np.stack([model.body_contype[bodies], model.body_conaffinity[bodies]], axis=1)
        last: Array = np.full((len(free), 7), np.nan)
        frames: Array = np.full((len(moving), 4, 3), np.inf)  # at first everything is near
        now = data.xpos, data.xmat, last, frames, data.qpos, data.qvel, data.xfrc_applied
        self._contype, self._conaffinity = model.body_contype, model.body_conaffinity
        self._compiled = model.body_contype.copy(), model.body_conaffinity.copy()
        about = moving, bodies, collide, boxes, fixed, owners
        self._all = model.body_contype, model.body_conaffinity, kinds, data.body_awake, *about, *now, len(free)

    def __enter__(self) -> None:
        """Leave out what can touch nothing in the period that begins."""
        _leave_out(*self._all)

    def __exit__(self, *_: object) -> None:
        """Take all bodies in again: between two periods the model is the compiled one."""
        self._contype[:], self._conaffinity[:] = self._compiled
