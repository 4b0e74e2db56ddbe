"""Recognition of the stand-in shapes of tests/support/shapes.py: nothing may lean on the shipped five."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.recognition import MATCHERS, TargetModel
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.scalars import height_ratio
from glotouch_bt.robot.scene.meshes import load_mesh
from tests.support import shapes
from tests.support.acquisition import IDEAL, acquire

POSE = (0.03, -0.02, 0.7)


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("stl")
    names = ["cup", "l_block", "plate", "mushroom", "star", "disc", "wide"]
    shapes.write(folder, names)
    return {n: load_mesh(folder / f"{n}.stl") for n in names}


def test_a_top_that_was_not_felt_says_only_how_high_it_is_at_least(meshes) -> None:
    touched, _ = acquire(meshes["cup"], POSE, IDEAL, np.random.default_rng(0))
    low = replace(touched.candidate, height_m=0.018, top_touched=False)
    params = LikelihoodParams()
    cup = TargetModel.from_mesh(meshes["cup"])
    assert height_ratio(cup, low, params) == 0.0
    # A lower place may have been taken for the top; a higher one cannot.
    lower, higher = (
        height_ratio(cup, replace(touched.candidate, height_m=cup.height_m + d), params) for d in (-0.02, 0.02)
    )
    assert higher < lower < height_ratio(cup, replace(touched.candidate, height_m=cup.height_m), params)


def test_the_narrowest_way_through(meshes) -> None:
    """Through the middle: a block of 92 x 90 is 90 wide, a plate 8, a mushroom 22 at its stem."""
    assert TargetModel.from_mesh(meshes["wide"]).narrowest_m == pytest.approx(0.090, abs=1e-4)
    assert TargetModel.from_mesh(meshes["plate"]).narrowest_m == pytest.approx(0.008, abs=1e-4)
    assert TargetModel.from_mesh(meshes["mushroom"]).narrowest_m == pytest.approx(0.022, abs=2e-3)


@pytest.mark.study
def test_every_shape_knows_itself_among_all(meshes) -> None:
    names = [n for n in meshes if n != "wide"]
    touched = [acquire(meshes[n], POSE, IDEAL, np.random.default_rng(i), i)[0] for i, n in enumerate(names)]
    for i, name in enumerate(names):
        model = TargetModel.from_mesh(meshes[name])
        ranking = MATCHERS["likelihood"](model, touched)
        assert ranking.best.index == i, (name, [(names[m.index], round(m.loss, 2)) for m in ranking.matches])
        assert ranking.accepted, (name, ranking.reasons)
