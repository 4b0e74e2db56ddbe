"""Tables of a `TargetModel` from touch data: the likelihood, the schedule and the grasp read them as an STL's.

What was not touched is uncertain. `Certainty` holds the standard deviation of each width, and the probability that
width and image of a cell are predicted at all. Where they are not, the distribution over all objects is used.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np

from glotouch_bt.perception.recognition.model import (
    POOLED,
    Array32,
    Certainty,
    PadSpec,
    TargetModel,
    axes_within,
)
from glotouch_bt.perception.recognition.touched.memory import FeltClosure, TouchedObject
from glotouch_bt.perception.recognition.touched.outlines import extents_m, retraced
from glotouch_bt.perception.recognition.touched.widths import WidthKernel, interpolated
from glotouch_bt.robot import Array

KERNEL = WidthKernel()
"""Kernel of the widths."""
VAGUE_M = 2.5e-3
"""Standard deviation of a width at which it is predicted as well as that of any object felt beside it. Source:
`background.WIDTH_SCALE_M`."""
IMAGE_PHI_RAD, IMAGE_L_M, IMAGE_Z_M = math.radians(10.0), 4e-3, 4e-3
"""Distances from a felt image within which another image is like it. Source: ours; a block of an image is 4 mm."""
OVERHANG_M = 0.015
"""The tables reach this far beyond the outline: the object may be wider above it. Source: ours."""
TOP_SD_M, LEAN_RAD = 1.2e-3, 0.03
"""Standard deviations of a measured top, and of the lean of the object when it was measured. Source:
`LikelihoodParams`."""
MAX_CACHED = 16
"""Largest number of models in the cache. Source: ours; one takes 20 MB."""
TOPS = 8
"""Number of tops of parts, all unknown: each is the whole object's. Source: `model.tops`."""

_cache: dict[tuple[str, str, PadSpec], TargetModel] = {}
"""Models by name, digest and pad, the oldest first."""


def touched_model(felt: TouchedObject, pad: PadSpec) -> TargetModel:
    """Return the model of an object that is known only by touch (below a second; the latest are cached)."""
    key = (felt.name, digest_of(felt), pad)
    if key not in _cache:
        while len(_cache) >= MAX_CACHED:
            del _cache[next(iter(_cache))]
        _cache[key] = _build(felt, pad)
    return _cache[key]


def _build(felt: TouchedObject, pad: PadSpec) -> TargetModel:
    contours = [e.contour for e in felt.encounters]
    radius = max(float(np.linalg.norm(c.outline_K_m(), axis=1).max()) for c in contours) + OVERHANG_M
    axes = axes_within(radius, felt.height_m, pad)
    phi, l, z = axes.phi_rad, axes.l_m, axes.z_m
    half = 0.5 * pad.window_m[0]
    sides = [extents_m(c, phi, l, half) for c in contours]
    low, high = (_filled(np.mean([s[i] for s in sides], axis=0)) for i in range(2))
    two_sided = [c for c in felt.closures if c.two_sided]
    at = np.array([[c.phi_rad, c.along_m, c.height_m] for c in two_sided])
    traced = np.array([_extent_m(phi, l, high - low, c) for c in two_sided])
    places = np.stack(np.meshgrid(phi[: len(phi) // 2], l, z, indexing="ij"), axis=-1)
    residual, sd = interpolated(at, np.array([c.width_m for c in two_sided]) - traced, places.reshape(-1, 3), KERNEL)
    residual, sd = (_both_ways(x.reshape(places.shape[:3])) for x in (residual, sd))
    width = np.maximum((high - low)[:, :, None] + residual, 1e-3)
    reach = 0.5 * width + 0.5 * (high + low)[:, :, None]
    images, image_known = _images(felt.closures, phi, l, z)
    certainty = Certainty(
        sd.astype(np.float32), (1.0 / (1.0 + (sd / VAGUE_M) ** 2)).astype(np.float32), image_known,
        math.hypot(TOP_SD_M, LEAN_RAD * 0.5 * max(c.size_m[0] for c in contours)) / math.sqrt(len(contours)),
    )  # fmt: skip
    stored = np.ascontiguousarray(images.transpose(2, 1, 3, 0))
    long, short = max((c.size_m for c in contours), key=lambda size: size[0])
    return TargetModel(
        felt.name, digest_of(felt), pad, phi, l, z, reach.astype(np.float32), np.zeros((len(phi), 0, 0), np.float32),
        retraced(contours), np.zeros(2), felt.height_m, np.full(TOPS, felt.height_m), 0.3, 0.3, 0.0, 1.0 - short / long,
        certainty=certainty,
        _lazy={"images": stored},
    )  # fmt: skip


def digest_of(felt: TouchedObject) -> str:
    """Return a hash of all values of all encounters."""
    digest = hashlib.sha256()
    for e in felt.encounters:
        o = e.contour
        values = [e.height_m, o.size_m, o.centre_K_m, o.yaw_rad, o.rms_m, o.covariance, o.boundary_K_m]
        for c in e.closures:
            values += [c.phi_rad, c.along_m, c.height_m, c.aperture_m, c.width_m, c.areas]
            values += [image for image in c.images if image is not None]
        digest.update(f"{o.kind} {o.family} {[[i is None for i in c.images] for c in e.closures]}".encode())
        for value in values:
            array = np.asarray(value, dtype="<f8")
            digest.update(f"{array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


def _filled(extent: Array) -> Array:
    """Return extents (yaws, shifts) with those beside the outline replaced by the nearest ones of the same yaw."""
    out = extent.copy()
    for row in out:
        known = np.flatnonzero(np.isfinite(row))
        row[:] = np.interp(np.arange(len(row)), known, row[known])
    return out


def _extent_m(phi: Array, l: Array, extent: Array, c: FeltClosure) -> float:
    i = round(c.phi_rad / (2 * math.pi) * len(phi)) % len(phi)
    return float(np.interp(c.along_m, l, extent[i]))


def _both_ways(half: Array) -> Array:
    """Return a table of all yaws from that of the first half turn: widths are the same from both sides."""
    return np.concatenate([half, half[:, ::-1]])


def _images(closures: tuple[FeltClosure, ...], phi: Array, l: Array, z: Array) -> tuple[Array32, Array32]:
    """Return for each cell the nearest felt image of the left pad (yaws, shifts, heights, 35), and how alike it is."""
    seen: list[tuple[float, float, float, Array]] = []
    for c in closures:
        left, right = c.images
        if left is not None:
            seen.append((c.phi_rad, c.along_m, c.height_m, left))
        if right is not None:  # the right pad views the opposite side: its columns are reversed
            turned = np.asarray(right).reshape(POOLED)[:, ::-1].reshape(-1)
            seen.append((c.phi_rad + math.pi, -c.along_m, c.height_m, turned))
    at = np.array([s[:3] for s in seen])
    off_phi = (phi[:, None] - at[:, 0] + math.pi) % (2 * math.pi) - math.pi
    off_l, off_z = l[:, None] - at[:, 1], z[:, None] - at[:, 2]
    squared = (
        (off_phi / IMAGE_PHI_RAD)[:, None, None] ** 2
        + (off_l / IMAGE_L_M)[None, :, None] ** 2
        + (off_z / IMAGE_Z_M)[None, None] ** 2
    )  # (yaws, shifts, heights, felt)
    nearest = squared.argmin(axis=-1)
    known = np.exp(-0.5 * np.take_along_axis(squared, nearest[..., None], axis=-1)[..., 0])
    table = np.array([s[3] for s in seen], dtype=np.float32)
    return table[nearest], known.astype(np.float32)
