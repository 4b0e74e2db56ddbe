"""Background model: likelihood of a squeeze of SOME object.

Images: random local surfaces (quadrics with edges, steps and ridges) under the same gel model and kernel as the target,
so that common features such as flat faces are weak evidence. Widths: prediction from the outline, the layer below and
the same layer of the previous sequence.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from glotouch_bt.perception.recognition.evidence import LayerEvidence
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.model import FINE, Array32, PadSpec, image_feature, touch_windows
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array

SURFACES = 1500
"""Number of random surfaces. Two seeds agree in log density within 0.1."""
WIDTH_SCALE_M = 2.5e-3
"""Cauchy scale of a width about that of the layer below or of the previous sequence."""
FIRST_SCALE_M = 4e-3
"""Cauchy scale of a first width about the outline's span."""


@lru_cache(maxsize=8)
def generic_features(pad: PadSpec) -> Array32:
    """Return image features (SURFACES, 35) of random local surfaces; deterministic (0.1 s once)."""
    rng = np.random.default_rng(0)
    n = SURFACES
    u = ((np.arange(FINE[1]) + 0.5) / FINE[1] - 0.5) * pad.window_m[0]
    v = ((np.arange(FINE[0]) + 0.5) / FINE[0] - 0.5) * pad.window_m[1]
    x, z = (a[None] for a in np.meshgrid(u, v, indexing="ij"))  # (1, 15, 21)

    def draw(low: float, high: float) -> Array:
        return rng.uniform(low, high, (n, 1, 1))

    def some(p: float) -> Array:
        return np.asarray(rng.random((n, 1, 1)) < p)

    turn = draw(0, np.pi)
    a, b = np.cos(turn) * x + np.sin(turn) * z, -np.sin(turn) * x + np.cos(turn) * z
    aligned = some(0.6)  # upright objects have horizontal and vertical principal curvatures
    a, b = np.where(aligned, x, a), np.where(aligned, z, b)
    flat = rng.random((n, 1, 1)) < 0.25
    ka = np.where(np.logical_or(flat, some(0.2)), 0.0, 1 / np.exp(draw(math.log(0.006), math.log(0.06))))
    kb = np.where(
        np.logical_or(flat, some(0.6)), 0.0, np.sign(draw(-0.3, 1)) / np.exp(draw(math.log(0.010), math.log(0.10)))
    )
    h = -0.5 * ka * (a - draw(-4e-3, 4e-3)) ** 2 - 0.5 * kb * (b - draw(-8e-3, 8e-3)) ** 2
    h = h + np.where(some(0.4), draw(-0.25, 0.25), 0) * z + np.where(some(0.4), draw(-0.15, 0.15), 0) * x
    steps = some(0.25) * (z > draw(-10e-3, 10e-3)) * draw(-4e-3, 4e-3)
    ridge = some(0.15) * -np.abs(x - draw(-6e-3, 6e-3)) * draw(0.2, 1.5)
    h = h + steps + ridge
    gone = some(0.25) * (z > draw(-4e-3, 14e-3))
    gone = gone + some(0.12) * (z < draw(-14e-3, 0))
    gone = gone + some(0.15) * (x * np.sign(draw(-1, 1)) > draw(-2e-3, 8e-3))
    surfaces: Array32 = np.where(gone > 0, -np.inf, h).astype(np.float32)
    out: Array32 = image_feature(touch_windows(surfaces, pad)).astype(np.float32)
    out.setflags(write=False)
    return out


def image_kernel(squared: Array32, p: LikelihoodParams) -> Array32:
    """Return the unnormalised density of an image at mean squared feature distance `squared` from a prediction."""
    near = 1 + squared * np.float32(1 / p.image_scale**2)
    if p.image_order == 3.0:  # several times faster than a power
        return np.asarray(1 / (near * near * near))
    return np.asarray(near ** np.float32(-p.image_order))


def log_generic_images(layers: tuple[LayerEvidence, ...], pad: PadSpec, p: LikelihoodParams) -> Array:
    """Return the background log density (n, 2) of (left, right) images, in units of log `image_kernel`; 0 without one.

    A mixture of the surface library and of neighbouring images: below on the same pad, at the same height in the
    previous sequence, on the other pad. So repeated images of one wall are not independent evidence.
    """
    known: dict[tuple[int, int, int], Array32] = {
        (e.sequence, e.index, side): image.astype(np.float32)
        for e in layers
        for side, image in enumerate(e.images)
        if image is not None
    }
    out = np.zeros((len(layers), 2))
    if not known:
        return out
    place = {key: i for i, key in enumerate(known)}
    images = np.array(list(known.values()))
    squared = mean_squared(images, generic_features(pad))
    anything = image_kernel(squared, p).mean(axis=1)
    alike = image_kernel(mean_squared(images, images), p)
    for i, e in enumerate(layers):
        for side in (0, 1):
            at = place.get((e.sequence, e.index, side))
            if at is None:
                continue
            guesses = [float(alike[at, place[k]]) for k in neighbours_of(e, side) if k in place]
            out[i, side] = math.log(mixed_density(float(anything[at]), guesses, p) + 1e-12)
    return out


def neighbours_of(e: LayerEvidence, side: int) -> list[tuple[int, int, int]]:
    """Return the keys (sequence, index, pad) of earlier images that resemble an image on any object."""
    beside = [(e.sequence, e.index - 1, side), (e.sequence - 1, e.index, side)]
    return [*beside, (e.sequence, e.index, 0)] if side == 1 else beside


def mixed_density(anything: float, guesses: list[float], p: LikelihoodParams) -> float:
    """Return the background density of an image: of any surface, and of those like the `guesses` of its neighbours."""
    if not guesses:
        return anything
    return (1 - p.image_alike) * anything + p.image_alike * sum(guesses) / len(guesses)


def mean_squared(a: Array32, b: Array32) -> Array32:
    """Return mean squared distances (len(a), len(b)) of features (.., 35)."""
    d = (a**2).sum(axis=1)[:, None] - 2 * a @ b.T + (b**2).sum(axis=1)[None]
    return np.asarray(np.maximum(d, 0) * np.float32(1 / a.shape[1]))


def log_generic_widths(layers: tuple[LayerEvidence, ...], candidate: Candidate, p: LikelihoodParams) -> Array:
    """Return the background log density (n,), per metre, of each width given earlier widths and the outline.

    A width that is only an upper bound is uniform above the object's own, as it is for the target.
    """
    out = np.zeros(len(layers))
    known: dict[tuple[int, int], float] = {}
    for i, e in enumerate(layers):
        guesses = [(w, WIDTH_SCALE_M) for (s, h), w in known.items() if s == e.sequence and abs(h - e.index) == 1]
        guesses += [(w, WIDTH_SCALE_M) for (s, h), w in known.items() if s == e.sequence - 1 and h == e.index]
        if not guesses:
            low, high = candidate.span_m(e.yaw_rad + 0.5 * math.pi)
            guesses = [(high - low, FIRST_SCALE_M)]
        # The Cauchy tails allow steps of the object.
        if e.upper_only:
            below = np.mean([0.5 + math.atan((e.width_m - w) / s) / math.pi for w, s in guesses])
            density = below / p.width_range_m
        else:
            density = np.mean([s / math.pi / (s**2 + (e.width_m - w) ** 2) for w, s in guesses])
            known[(e.sequence, e.index)] = e.width_m
        out[i] = math.log((1 - p.width_outlier) * density + p.width_outlier / p.width_range_m)
    return out
