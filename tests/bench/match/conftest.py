"""Layouts of made-up TouchSets, and a matcher whose answers can be worked out by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.bench.match import trials
from glotouch_bt.bench.match.dataset import Layout, Touched
from glotouch_bt.perception.recognition import Match, Ranking
from glotouch_bt.perception.touch import Candidate, Contour, Layer, TouchSequence, TouchSet

SIZES_M = {"small": 0.04, "middle": 0.06, "large": 0.08}


def touchset(index, size_m, layers=(2, 1), centre=(0.0, 0.0), stable=True):
    """A round candidate; the apertures of its closures are its size."""
    contour = Contour("round", np.array(centre), (size_m, size_m), 0.0, 1e-4, np.zeros(3))
    pad = np.full((7, 5), 1e-4)
    squeezed = tuple(
        TouchSequence(
            np.array(centre),
            0.5 * j,
            tuple(Layer(0.02 + 0.01 * k, size_m, np.array(centre), 0.5 * j, pad, pad, 10.0, stable) for k in range(n)),
        )
        for j, n in enumerate(layers)
    )
    return TouchSet(Candidate(index, contour, 0.07, 1.0, ()), squeezed)


def a_layout(seed=3, names=("small", "middle", "large"), sizes=None, layers=(2, 1)):
    """Candidate i is the object names[i] (None: of no object) and feels sizes[i] wide."""
    felt = [
        Touched(touchset(i, s, layers), n, None if n is None else (0.0, 0.0, 0.2), None if n is None else 0.0)
        for i, (n, s) in enumerate(zip(names, sizes or [SIZES_M.get(n, 0.05) for n in names], strict=True))
    ]
    return Layout(seed, "nominal", tuple(sorted(SIZES_M)), tuple(felt), "success", 100.0)


def by_size(shown, touchsets):
    """Rank by size, for a `Target` or its model.

    Loss: difference of sizes in cm. Accepted if below 0.5; P falls with the square, the rest is p_absent.
    """
    size_m = SIZES_M[getattr(shown, "model", shown).name]
    loss = {t.candidate.index: 100 * abs(t.candidate.contour.size_m[0] - size_m) for t in touchsets}
    weight = {
        i: math.exp(-(x**2) * 4) * sum(len(s.layers) > 0 for s in t.sequences)
        for (i, x), t in zip(loss.items(), touchsets, strict=True)
    }
    total = sum(weight.values()) + 0.02
    matches = tuple(
        Match(i, x, {"size": x}, None, (0.003, 0.004, 0.3), 3.0, probability=weight[i] / total)
        for i, x in sorted(loss.items(), key=lambda p: p[1])
    )
    sure = matches[0].loss < 0.5
    return Ranking(matches, math.inf, sure, () if sure else ("too far",), 0.02 / total)


@pytest.fixture
def made_up(monkeypatch):
    """Models that are names, meshes that have no symmetry, and `by_size` in place of every matcher."""
    models = {n: SimpleNamespace(name=n) for n in SIZES_M}
    monkeypatch.setattr(
        trials, "models_of", lambda layout, folder, names=(): {n: models[n] for n in names or layout.objects}
    )
    monkeypatch.setattr(
        trials, "meshes_of", lambda folder: {n: SimpleNamespace(name=n, digest=f"{folder}{n}") for n in SIZES_M}
    )
    monkeypatch.setattr(trials, "symmetries_rad", lambda mesh: np.zeros(1))
    monkeypatch.setattr(trials, "twins", lambda a, b: {a.name, b.name} == {"small", "middle"})
    monkeypatch.setattr(trials, "methods", lambda: {"likelihood": by_size})
    return models
