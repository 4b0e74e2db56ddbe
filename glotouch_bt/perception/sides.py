"""The sides on which the target may stand, as hypotheses of its model.

Sides on which an object feels the same, as the six of a cube, are one hypothesis. An object that rolls, such as a lying
cylinder, has no stable side there and no hypothesis.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.model_cache import target_model
from glotouch_bt.perception.recognition.model import PadSpec, TargetHypothesis, TargetModel
from glotouch_bt.robot import Array, ParamError
from glotouch_bt.robot.scene import UPRIGHT, ByDigest, Mesh, Quat, stances, standing

TOPPLED_PRIOR = 0.1
"""Prior probability that an object of an upright world lies: the probe and the jaws topple some. Source: ours."""
MIN_SHARE = 0.03
"""Minimum share of a side, 0..1; that of the file has at least this weight. Source: ours."""
MAX_SIDES = 6
"""Largest number of sides besides upright. Source: ours."""
SAMPLES = 4000
"""Number of points on the surface by which sides are compared."""
BEARINGS, LEVELS, LEVEL_M = 72, 8, 0.015
"""Numbers of bearings and of levels, and height of a level, at which the points' reach is compared; the last level has
no upper end."""
ALIKE_M = 0.0015
"""Maximum RMS difference in reach of two sides that feel the same. Source: ours. A truck on its wheels and on its roof
differs by 1.9 mm, and is not recognised by the other side; an apple on sides of like tilt by 0.3 to 1.4 mm."""


def model_with_sides(mesh: Mesh, pad: PadSpec, stance: str) -> TargetModel:
    """Return an object's model with a hypothesis for each side on which it may stand.

    Args:
        mesh: The object.
        pad: The pad.
        stance: "upright": as in its file, or toppled; "any": on any stable side.

    Raises:
        ParamError: The object is too low for probe and pads as in its file.
    """
    model = target_model(mesh, pad)
    return replace(model, sides=_sides(ByDigest(mesh), pad, stance))


@lru_cache(maxsize=32)
def _sides(key: ByDigest, pad: PadSpec, stance: str) -> tuple[TargetHypothesis, ...]:
    mesh = key.mesh
    shares = _distinct_sides(mesh)
    if stance == "any":
        weights = {q: max(s, MIN_SHARE) for q, s in shares.items() if q == UPRIGHT or s >= MIN_SHARE}
    else:
        lying = {q: TOPPLED_PRIOR * s for q, s in shares.items() if q != UPRIGHT and s >= MIN_SHARE}
        weights = {UPRIGHT: 1.0 - sum(lying.values()), **lying}
    found = []
    for quat, weight in sorted(weights.items(), key=lambda w: (w[0] != UPRIGHT, -w[1]))[: 1 + MAX_SIDES]:
        try:
            found.append(TargetHypothesis(target_model(standing(mesh, quat), pad), quat, weight))
        except ParamError:  # lower than the probe's ball on this side: it cannot be traced there
            continue
    total = sum(h.weight for h in found)
    return tuple(replace(h, weight=h.weight / total) for h in found)


def _distinct_sides(mesh: Mesh) -> dict[Quat, float]:
    """Return the share of each side that feels different from the others; the file's own is among them."""
    points = _surface(mesh)
    found = sorted(stances(mesh), key=lambda s: (s[0] != UPRIGHT, -s[1]))
    total = sum(share for _, share in found) or 1.0
    kept: list[tuple[Quat, Array]] = [(UPRIGHT, _reach(mesh, points, UPRIGHT))]
    shares = {UPRIGHT: 0.0}
    for quat, share in found:
        reach = _reach(mesh, points, quat)
        like = next((q for q, other in kept if q == quat or _is_alike(reach, other)), quat)
        if like == quat and quat != UPRIGHT:
            kept.append((quat, reach))
        shares[like] = shares.get(like, 0.0) + share / total
    return shares


def _surface(mesh: Mesh) -> Array:
    """Return points (n, 3) spread over the surface, the same ones each time."""
    rng = np.random.default_rng(0)
    corners = mesh.vertices_m[mesh.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[rng.choice(len(corners), SAMPLES, p=area / area.sum())]
    a, b = np.sqrt(rng.random(SAMPLES)), rng.random(SAMPLES)
    weights = np.stack([1 - a, a * (1 - b), a * b], axis=1)
    return np.asarray(np.einsum("ni,nij->nj", weights, chosen))


def _reach(mesh: Mesh, points_m: Array, quat: Quat) -> Array:
    """Return the reach (BEARINGS, LEVELS), m, of a side's points from the middle of its footprint; 0 without points.

    The points (n, 3) are in the frame of the file.
    """
    placed = standing(replace(mesh, vertices_m=points_m), quat).vertices_m
    reach = np.zeros((BEARINGS, LEVELS))
    _reach_of(np.ascontiguousarray(placed), reach)
    return reach


@compiled("given f8[:, ::1]", "f8[:, ::1]")
def _reach_of(points: Array, reach: Array) -> None:
    """Fill the reach (BEARINGS, LEVELS) of points (n, 3) from the origin."""
    seen = np.zeros(LEVELS, dtype=np.bool_)
    cosine, sine = np.zeros(BEARINGS), np.zeros(BEARINGS)
    for b in range(BEARINGS):
        angle = b * (2.0 * np.pi / BEARINGS)
        cosine[b], sine[b] = np.cos(angle), np.sin(angle)
    for i in range(len(points)):
        level = min(int(points[i, 2] / LEVEL_M), LEVELS - 1)
        for b in range(BEARINGS):
            along = cosine[b] * points[i, 0] + sine[b] * points[i, 1]
            if not seen[level] or along > reach[b, level]:
                reach[b, level] = along
        seen[level] = True


@compiled("f8[:, ::1]", "f8[:, ::1]")
def _is_alike(a: Array, b: Array) -> bool:
    """Return True if two sides reach equally far, but for a turn about the vertical."""
    used = np.zeros(LEVELS, dtype=np.bool_)
    for i in range(BEARINGS):
        for level in range(LEVELS):
            used[level] |= a[i, level] != 0.0 or b[i, level] != 0.0
    limit = ALIKE_M * ALIKE_M * BEARINGS * used.sum()
    for turn in range(BEARINGS):
        square = 0.0
        for i in range(BEARINGS):
            for level in range(LEVELS):
                off = a[(i + turn) % BEARINGS, level] - b[i, level]
                square += off * off
            if square >= limit:
                break
        if square < limit:
            return True
    return False
