"""Expected information gain: bounds, and what must and must not be worth a closure."""

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.recognition import Closure, TargetModel
from glotouch_bt.perception.recognition.likelihood import closure_options, expected_gain, infer_belief
from glotouch_bt.robot import ParamError
from tests.support.acquisition import NOMINAL, acquire


@pytest.fixture(scope="module")
def meshes(solids):
    return [solids.box(0.080, 0.040, 0.060), solids.box(0.076, 0.044, 0.060), solids.cylinder(0.025, 0.070)]


@pytest.fixture(scope="module")
def sets(meshes):
    made = []
    for i, mesh in enumerate(meshes):
        rng = np.random.default_rng(30 + i)
        made.append(acquire(mesh, (0.1 * i - 0.1, 0.02, 0.3 + i), NOMINAL, rng, i)[0])
    return made


def entropy(ranking) -> float:
    p = np.array([m.probability for m in ranking.matches] + [ranking.p_absent])
    return float(-(p * np.log(np.maximum(p, 1e-300))).sum())


def options(touchsets) -> list[Closure]:
    return [c for t in touchsets for c in closure_options(t)]


def test_gain_is_between_nothing_and_all_that_is_open(meshes, sets) -> None:
    model = TargetModel.from_mesh(meshes[0])
    for kept in (0, 1, 3):
        belief = infer_belief(model, [replace(t, sequences=t.sequences[:kept]) for t in sets])
        gains = expected_gain(belief, options(sets))
        assert (gains >= 0).all()
        assert (gains <= entropy(belief.ranking) + 1e-9).all()


def test_what_the_outline_leaves_open_is_worth_more_than_what_it_excludes(meshes, sets) -> None:
    """Before any closure: the two boxes are alike, the cylinder is surely no box."""
    belief = infer_belief(TargetModel.from_mesh(meshes[0]), [replace(t, sequences=()) for t in sets])
    gains = expected_gain(belief, options(sets))
    best = {i: max(g for g, c in zip(gains, options(sets), strict=True) if c.candidate == i) for i in range(3)}
    assert best[0] > best[2]
    assert best[0] > 0.05


def test_a_closure_made_before_is_worth_little(meshes, sets) -> None:
    twin = replace(sets[0], candidate=replace(sets[0].candidate, index=1))
    few = [replace(t, sequences=t.sequences[:1]) for t in (sets[0], twin)]
    belief = infer_belief(TargetModel.from_mesh(meshes[0]), few)
    felt = belief.readings[0].sequences[0][0].layer
    again = few[0].sequences[felt.sequence].layers[felt.index]
    made = Closure(0, again.yaw_rad, again.height_m, np.asarray(again.position_K_m))
    other = replace(made, yaw_K_rad=made.yaw_K_rad + np.pi / 2)
    gains = expected_gain(belief, [made, other])
    assert gains[0] < 0.1 * gains[1]


def test_closures_on_unknown_candidates_are_refused(meshes, sets) -> None:
    belief = infer_belief(TargetModel.from_mesh(meshes[0]), sets)
    with pytest.raises(ParamError, match="candidate"):
        expected_gain(belief, [Closure(9, 0.0, 0.03, np.zeros(2))])
    assert len(expected_gain(belief, [])) == 0
