"""A model from touches alone agrees with the solid that was touched, and knows what was not felt."""

import math
from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.recognition import (
    MATCHERS,
    PadSpec,
    TargetModel,
    TouchedObject,
    beyond_jaws_m,
    encounter_of,
    touched_model,
)
from glotouch_bt.perception.recognition.likelihood.pair import compare, read_touchset
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.robot import ParamError
from tests.support.acquisition import IDEAL, NOMINAL, acquire

PAD = PadSpec()
likelihood = MATCHERS["likelihood"]


def touches(mesh, disturbance=IDEAL, seed: int = 0, index: int = 0, pose=(0.0, 0.0, 0.0)):
    return acquire(mesh, pose, disturbance, np.random.default_rng(seed), index)[0]


def felt_once(mesh, disturbance=IDEAL, seed: int = 0) -> TouchedObject:
    return TouchedObject("thing", (encounter_of(touches(mesh, disturbance, seed), PAD),))


@pytest.fixture(scope="module")
def can(solids):
    return touched_model(felt_once(solids.cylinder(0.025, 0.070)), PAD)


@pytest.fixture(scope="module")
def meshes(solids):
    """Five solids of which no two have height and outline nearly alike: their touch models come from one handling."""
    return [
        solids.cylinder(0.025, 0.070),
        solids.cone(0.032, 0.080),
        solids.box(0.080, 0.040, 0.050),
        solids.box(0.060, 0.045, 0.060),
        solids.sphere(0.032),
    ]


def test_the_widths_through_the_middle_of_a_can_are_its_diameter(can) -> None:
    middle = can.width_m[:, len(can.l_m) // 2][:, (can.z_m > 0.02) & (can.z_m < 0.06)]
    np.testing.assert_allclose(middle, 0.050, atol=1e-3)


@pytest.mark.parametrize(
    ("wider_m", "sensing_m", "beyond_m"), [(0.0, 0.018, 0.0), (0.01, 0.018, 0.01), (0.01, 0.15, 0.0)]
)
def test_an_outline_cannot_reach_beyond_jaws_that_closed_at_its_height(solids, wider_m, sensing_m, beyond_m) -> None:
    encounter = encounter_of(touches(solids.cylinder(0.025, 0.070)), PAD)
    diameter_m = encounter.contour.size_m[0] + wider_m
    wider = replace(encounter, contour=replace(encounter.contour, size_m=(diameter_m, diameter_m)))
    assert beyond_jaws_m(wider, sensing_m, PAD) == pytest.approx(beyond_m, abs=1e-3)


def test_outline_and_height_of_a_can_are_its_own(can) -> None:
    assert can.outline.as_round.size_m[0] == pytest.approx(0.050, abs=1e-3)
    assert can.height_m == pytest.approx(0.070, abs=1e-6)
    assert can.outline.p_box == pytest.approx(1 / 3), "one encounter, by Laplace's rule"


def test_widths_are_the_same_from_both_sides(can) -> None:
    np.testing.assert_allclose(can.width_m, np.roll(can.width_m, 36, axis=0)[:, ::-1], atol=1e-6)
    sd = can.certainty.width_sd_m
    np.testing.assert_allclose(sd, np.roll(sd, 36, axis=0)[:, ::-1], atol=1e-6)


def test_uncertainty_grows_with_the_distance_from_what_was_felt(solids) -> None:
    whole = felt_once(solids.cylinder(0.025, 0.100))
    low = replace(whole.encounters[0], closures=tuple(c for c in whole.closures if c.height_m < 0.04))
    model = touched_model(TouchedObject("thing", (low,)), PAD)
    certainty = model.certainty
    i = round(low.closures[0].phi_rad / (2 * math.pi) * 72) % 72
    above = model.z_m > max(c.height_m for c in low.closures)
    sd = certainty.width_sd_m[i, len(model.l_m) // 2, above]
    assert (np.diff(sd) > 0).all()
    assert sd[0] < 1e-3 < 2.5e-3 < sd[-1], "far away no better than any object felt beside it"
    assert (np.diff(certainty.width_known[i, len(model.l_m) // 2, above]) < 0).all()
    assert certainty.image_known[i, len(model.l_m) // 2, above][-1] < 1e-3


@pytest.mark.study
@pytest.mark.parametrize("shape", range(5))
def test_the_true_widths_lie_within_the_stated_uncertainty(meshes, shape: int) -> None:
    """The truth is the mesh's own table of ray casts; its frame is that of the touches, because both poses are 0."""
    truth, model = TargetModel.from_mesh(meshes[shape], PAD), touched_model(felt_once(meshes[shape]), PAD)
    scaled = []
    for l in (-0.01, 0.0, 0.01):
        j = int(np.argmin(np.abs(model.l_m - l)))
        for k in np.flatnonzero(model.z_m < meshes[shape].extents_m[2]):
            for i in range(0, 72, 3):
                right = truth.width_at(float(model.l_m[j]), float(model.z_m[k]), float(model.phi_rad[i]))
                sd = math.hypot(float(model.certainty.width_sd_m[i, j, k]), 1e-3)
                scaled.append(abs(float(model.width_m[i, j, k]) - right) / sd)
    assert np.mean(np.array(scaled) < 2.0) > 0.9
    assert np.max(scaled) < 5.0


def test_each_object_is_found_among_the_others_and_missed_without_it(meshes) -> None:
    models = [touched_model(felt_once(m, NOMINAL, 50 + i), PAD) for i, m in enumerate(meshes)]
    poses = np.random.default_rng(1).uniform(-0.1, 0.1, (len(meshes), 3)) * [1, 1, 30]
    sets = [touches(m, NOMINAL, 90 + i, i, tuple(poses[i])) for i, m in enumerate(meshes)]
    for i, model in enumerate(models):
        assert likelihood(model, sets).best.index == i
        assert not likelihood(model, sets[:i] + sets[i + 1 :]).accepted


def test_what_the_model_does_not_know_is_no_evidence(can, solids) -> None:
    nothing = np.zeros_like(can.certainty.width_sd_m)
    blind = replace(can, certainty=replace(can.certainty, width_known=nothing, image_known=nothing))
    p = LikelihoodParams()
    for mesh in (solids.cylinder(0.025, 0.070), solids.cone(0.032, 0.080)):
        pair = compare(blind, read_touchset(touches(mesh, seed=3), PAD, p), p)
        assert pair.terms["width"] == pytest.approx(0.0, abs=1e-3)
        assert pair.terms["image"] == pytest.approx(0.0, abs=1e-3)
        assert pair.log_twin == pytest.approx(0.0, abs=0.05), "a twin cannot be told from it either"


def test_another_encounter_in_another_place_is_laid_over_the_first(solids) -> None:
    mesh = solids.box(0.080, 0.040, 0.060)
    first, pose = felt_once(mesh), (0.06, -0.04, 0.5)
    again = touches(mesh, seed=7, pose=pose)
    grown = first.grown(encounter_of(again, PAD, pose))
    a, b = (e.contour for e in grown.encounters)
    np.testing.assert_allclose(a.centre_K_m, 0.0, atol=1e-9)
    np.testing.assert_allclose(b.centre_K_m, 0.0, atol=1.5e-3)
    assert math.remainder(a.yaw_rad - b.yaw_rad, math.pi) == pytest.approx(0.0, abs=math.radians(3))
    before, after = (touched_model(x, PAD).certainty for x in (first, grown))
    inner = slice(10, -10)
    assert after.width_sd_m[:, inner].mean() <= before.width_sd_m[:, inner].mean()
    assert after.height_sd_m == pytest.approx(before.height_sd_m / math.sqrt(2), rel=0.02)


def test_an_object_whose_top_was_not_touched_is_refused(solids) -> None:
    touchset = touches(solids.cylinder(0.025, 0.070))
    unknown = replace(touchset, candidate=replace(touchset.candidate, top_touched=False))
    with pytest.raises(ParamError, match="top"):
        encounter_of(unknown, PAD)
    with pytest.raises(ParamError, match="closure"):
        TouchedObject("thing", (encounter_of(replace(touchset, sequences=()), PAD),))


@pytest.mark.parametrize("part", ["image", "area", "width", "size"])
def test_objects_that_differ_in_one_value_have_models_of_their_own(solids, part: str) -> None:
    felt = felt_once(solids.cylinder(0.025, 0.070))
    encounter = felt.encounters[0]
    first = next(c for c in encounter.closures if c.images[0] is not None)
    changed = {
        "image": replace(first, images=(first.images[0] + 0.01, first.images[1])),
        "area": replace(first, areas=(first.areas[0] + 0.01, first.areas[1])),
        "width": replace(first, width_m=first.width_m + 1e-4),
    }.get(part, first)
    other = replace(encounter, closures=tuple(changed if c is first else c for c in encounter.closures))
    if part == "size":
        contour = encounter.contour
        other = replace(other, contour=replace(contour, size_m=tuple(s + 1e-4 for s in contour.size_m)))
    assert touched_model(felt, PAD).digest != touched_model(TouchedObject("thing", (other,)), PAD).digest
    assert touched_model(felt, PAD) is touched_model(TouchedObject("thing", (replace(encounter),)), PAD)
