"""A probe and real or ideal outlines without a simulator: rays of a ball against point clouds, synthetic wrenches."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.touch.outline.contours import widest_gap
from glotouch_bt.robot import GripperState, Observation

OBJECTS = Path(__file__).parents[3] / "glotouch_missions" / "objects"
TIP, SHAFT = 0.006, 0.004


def mesh_discs(path, height, rng):
    """Return surface points (n, 2) that a vertical probe at `height` can touch, each with a contact radius (n,)."""
    mesh = trimesh.load_mesh(path)
    mesh.apply_translation([0, 0, -mesh.bounds[0, 2]])
    points, _ = trimesh.sample.sample_surface(mesh, 40000, seed=int(rng.integers(1 << 30)))
    dz = points[:, 2] - height
    radius = np.where(np.abs(dz) < TIP, np.sqrt(np.maximum(TIP**2 - dz**2, 0)), 0.0)
    radius = np.where(dz > 0, np.maximum(radius, SHAFT), radius)
    keep = radius > 0
    return points[keep, :2], radius[keep]


def polygon_discs(vertices, step=2e-4):
    """Return the same for an upright prism over a polygon (n, 2)."""
    closed = np.vstack([vertices, vertices[:1]])
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))]
    at = np.arange(0, length[-1], step)
    points = np.column_stack([np.interp(at, length, closed[:, i]) for i in (0, 1)])
    return points, np.full(len(points), TIP)


def touch(discs, start, goal):
    """Return the ball centre (2,) at the first contact of a straight move, or None."""
    points, radius = discs
    u = (goal - start) / np.linalg.norm(goal - start)
    d = points - start
    along, across = d @ u, d @ np.array([-u[1], u[0]])
    hit = (np.abs(across) < radius) & (along > 0)
    if not hit.any():
        return None
    t = np.min(along[hit] - np.sqrt(radius[hit] ** 2 - across[hit] ** 2))
    return start + t * u if t < np.linalg.norm(goal - start) else None


def next_direction(tips, contour):
    """Return the bearing of the next probe: an untouched face of a box, else the middle of the widest gap."""
    offset = tips - contour.centre_K_m
    faces = untouched_faces(tips, contour)
    return faces[0] if faces else widest_gap(np.arctan2(offset[:, 1], offset[:, 0]))[0]


def needs_more(tips, contour):
    """Return True while the outline needs another contact: 6 to 12, 8 for a box, all sides, a good fit."""
    if len(tips) >= 12 or len(tips) < 6:
        return len(tips) < 6
    offset = tips - contour.centre_K_m
    _, gap = widest_gap(np.arctan2(offset[:, 1], offset[:, 0]))
    if gap > np.deg2rad(100.0) or (contour.rms_m > 0.0015 and len(tips) < 10):
        return True
    return contour.kind == "box" and (len(tips) < 8 or len(untouched_faces(tips, contour)) > 0)


def untouched_faces(tips, contour):
    """Return the bearings of a box's faces without a contact."""
    if contour.kind != "box":
        return []
    c, s = np.cos(contour.yaw_rad), np.sin(contour.yaw_rad)
    local = (tips - contour.centre_K_m) @ np.array([[c, -s], [s, c]])
    over = np.abs(local) - 0.5 * np.asarray(contour.size_m)
    axis = np.argmax(over, axis=1)
    turn = np.array([[0.0, np.pi], [0.5 * np.pi, -0.5 * np.pi]])
    return [
        float(np.pi - np.mod(np.pi - (contour.yaw_rad + turn[i, j]), 2 * np.pi))
        for i in (0, 1)
        for j, sign in enumerate((1.0, -1.0))
        if not np.any((axis == i) & (np.sign(local[:, i]) == sign))
    ]


def trace(discs, rng, noise, tools, contacts=None):
    """Sweep until a contact, then probe into the widest gap until the outline is known."""
    centre_true = discs[0].mean(axis=0)
    tips = None
    while tips is None:
        a = rng.uniform(0, 2 * np.pi)
        u = np.array([np.cos(a), np.sin(a)])
        off = rng.uniform(-0.02, 0.02) * np.array([-u[1], u[0]])
        tips = touch(discs, centre_true + off - 0.15 * u, centre_true + off + 0.15 * u)
    tips = [tips + rng.normal(0, noise, 2)]
    centre = tips[0] + u * 0.034
    contour = None
    while True:
        t = np.array(tips)
        if len(t) >= 3:
            contour = tools.fit_contour(t, TIP, contact_sd_m=max(noise, 4.5e-4))
            centre = contour.centre_K_m
            if (contacts is None and not needs_more(t, contour)) or len(t) == contacts:
                return t, contour
        bearings = np.arctan2(*(t - centre).T[::-1])
        goal = widest_gap(bearings)[0] if contour is None else next_direction(t, contour)
        start = centre + 0.15 * np.array([np.cos(goal), np.sin(goal)])
        tip = touch(discs, start, centre)
        if tip is None:
            tip = touch(discs, start, centre_true)
        tips.append(tip + rng.normal(0, noise, 2))


def blocks(force_P, *, rng, lever, sd_force=0.05, sd_torque=0.003, speed=(0.0, 0.0, 0.0), latency=3, start_s=0.0):
    """Return observations of a down-pointing hand with tip force (n, 3) in S; the sensor lags by `latency` samples."""
    n = len(force_P) // 10 * 10
    late = np.vstack([np.repeat(force_P[:1], latency, axis=0), force_P])[:n] if latency else force_P[:n]
    wrench = np.hstack([late, np.cross(lever, late)])
    wrench[:, :3] += rng.normal(0, 1, (n, 3)) * sd_force
    wrench[:, 3:] += rng.normal(0, 1, (n, 3)) * sd_torque
    stamps = start_s + np.arange(1, n + 1) * 1e-3
    position = (stamps - start_s)[:, None] * np.asarray(speed) + np.array([0.6, 0.0, 0.3])
    quat = np.tile([0.0, 1.0, 0.0, 0.0], (n, 1))
    out = []
    for i in range(0, n, 10):
        s = slice(i, i + 10)
        out.append(
            Observation(
                stamp_s=stamps[s],
                q=np.zeros((10, 7)),
                dq=np.zeros((10, 7)),
                position_B_P=position[s],
                quat_B_P=quat[s],
                wrench_S=wrench[s],
                gripper=GripperState(float(stamps[i]), 0.016, 60.0, False),
            )
        )
    return out


@pytest.fixture(scope="session")
def bench():
    return SimpleNamespace(
        tip=TIP,
        objects=OBJECTS,
        mesh_discs=mesh_discs,
        polygon_discs=polygon_discs,
        touch=touch,
        trace=trace,
        blocks=blocks,
    )
