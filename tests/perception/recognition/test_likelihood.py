"""The right object has the greatest probability; evidence that is missing is never made up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.recognition import MATCHERS, TargetModel
from glotouch_bt.perception.recognition.evidence import read_evidence
from glotouch_bt.perception.recognition.likelihood import infer_belief
from glotouch_bt.perception.recognition.likelihood.pair import compare, observed_turns, read_touchset
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.posterior import log_ratio_to_others, probabilities, ratios
from glotouch_bt.perception.touch import TouchSequence, TouchSet
from glotouch_bt.robot import ParamError
from tests.perception.recognition.conftest import changed
from tests.support.acquisition import HARSH, IDEAL, NOMINAL, acquire

likelihood = MATCHERS["likelihood"]

PRIOR = LikelihoodParams()
BY_OUTLINE = 1 / (1 + PRIOR.twin * PRIOR.prior_absent / (1 - PRIOR.prior_absent))
"""Largest probability of one candidate without closures: a twin may have the same outline and height."""


def touched(mesh, disturbance, seed: int, index: int = 0):
    rng = np.random.default_rng(seed)
    pose = (rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(-np.pi, np.pi))
    return acquire(mesh, pose, disturbance, rng, index)


def ratio(mesh, touchset) -> float:
    model = TargetModel.from_mesh(mesh)
    p = LikelihoodParams()
    return compare(model, read_touchset(touchset, model.pad, p), p).log_ratio


def total(ranking) -> float:
    return sum(m.probability for m in ranking.matches) + ranking.p_absent


@pytest.mark.parametrize(("disturbance", "seed"), [(NOMINAL, 11), (HARSH, 12)], ids=["nominal", "harsh"])
def test_each_target_finds_itself(meshes, disturbance, seed: int) -> None:
    sets = [touched(m, disturbance, 100 * seed + i, i)[0] for i, m in enumerate(meshes)]
    for i, mesh in enumerate(meshes):
        ranking = likelihood(TargetModel.from_mesh(mesh), sets)
        assert ranking.best.index == i, [(m.index, m.loss, m.terms) for m in ranking.matches]
        assert total(ranking) == pytest.approx(1.0, abs=1e-9)


def test_a_target_that_is_not_there_is_absent(meshes, solids) -> None:
    sets = [touched(m, NOMINAL, 40 + i, i)[0] for i, m in enumerate(meshes)]
    for stranger in (solids.box(0.050, 0.035, 0.090), solids.cylinder(0.032, 0.050)):
        ranking = likelihood(TargetModel.from_mesh(stranger), sets)
        assert not ranking.accepted
        assert ranking.p_absent > 0.9
        assert ranking.next_touch is None or ranking.next_touch.gain_nats > 0
        assert "none of them" in ranking.reasons[0]


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_an_object_of_slightly_other_size_is_still_itself(meshes, solids, factor: float) -> None:
    """All its widths are off by one factor; a likelihood without a common bias takes that for another object."""
    touchset, _ = touched(solids.box(0.080 * factor, 0.040 * factor, 0.060 * factor), IDEAL, 21)
    model = TargetModel.from_mesh(meshes[2])
    known = LikelihoodParams()
    exact = replace(known, scale_sd=1e-6, offset_sd_m=1e-6)
    one, other = (compare(model, read_touchset(touchset, model.pad, p), p) for p in (known, exact))
    assert one.log_ratio > other.log_ratio
    assert one.log_twin < other.log_twin
    assert one.bias_m == pytest.approx(0.040 * (factor - 1.0), abs=3e-4)


def test_two_alike_share_the_probability(meshes) -> None:
    one, _ = touched(meshes[2], IDEAL, 2)
    twin = replace(one, candidate=replace(one.candidate, index=7))
    ranking = likelihood(TargetModel.from_mesh(meshes[2]), (one, twin))
    assert not ranking.accepted
    assert [m.probability for m in ranking.matches] == pytest.approx([0.5, 0.5], abs=0.01)
    assert ranking.next_touch is not None


def test_order_of_candidates_does_not_matter(meshes) -> None:
    sets = [touched(m, NOMINAL, 60 + i, i)[0] for i, m in enumerate(meshes)]
    model = TargetModel.from_mesh(meshes[1])
    a, b = likelihood(model, sets), likelihood(model, sets[::-1])
    assert [m.index for m in a.matches] == [m.index for m in b.matches]
    assert a.p_absent == pytest.approx(b.p_absent)


def test_pose_of_a_box(meshes) -> None:
    """One that squeezes do not move is found within 3 mm and 4 degrees, up to its own symmetry (half a turn)."""
    still = replace(NOMINAL, drift_m=0.0, drift_rad=0.0, turn_rad=0.0)
    for seed in range(4):
        touchset, end = touched(meshes[2], still, seed)
        x, y, yaw = likelihood(TargetModel.from_mesh(meshes[2]), [touchset]).best.pose_K_O
        assert np.hypot(x - end[0], y - end[1]) < 3e-3
        assert abs((yaw - end[2] + np.pi / 2) % np.pi - np.pi / 2) < np.deg2rad(4)


def test_the_frame_of_the_file_does_not_matter(meshes, solids) -> None:
    """Turning and moving the mesh in its file moves pose_K_O, not where the solid is; the evidence stays."""
    angle = np.deg2rad(40.0)
    mesh = meshes[3]
    other = solids.moved(mesh, angle, 0.010, -0.020)
    touchset, _ = touched(mesh, IDEAL, 3)
    a = likelihood(TargetModel.from_mesh(mesh), [touchset]).best
    b = likelihood(TargetModel.from_mesh(other), [touchset]).best
    c, s = np.cos(b.pose_K_O[2]), np.sin(b.pose_K_O[2])
    middle = np.array(b.pose_K_O[:2]) + np.array([c * 0.010 + s * 0.020, s * 0.010 - c * 0.020])
    np.testing.assert_allclose(middle, a.pose_K_O[:2], atol=2.5e-3)
    assert ratio(other, touchset) == pytest.approx(ratio(mesh, touchset), abs=1.5)


def test_tessellation_does_not_matter(meshes, solids) -> None:
    touchset, _ = touched(meshes[3], NOMINAL, 4)
    assert ratio(solids.refined(meshes[3]), touchset) == pytest.approx(ratio(meshes[3], touchset), abs=0.3)


def test_a_hand_turned_by_half_a_turn_feels_the_same(meshes) -> None:
    """Left and right pads swap and columns reverse; the evidence stays."""
    mesh = meshes[1]
    touchset, _ = touched(mesh, NOMINAL, 5)
    turned = tuple(
        TouchSequence(
            s.position_K_m,
            s.yaw_rad + np.pi,
            tuple(
                replace(l, yaw_rad=l.yaw_rad + np.pi, left_m=l.right_m[:, ::-1], right_m=l.left_m[:, ::-1])
                for l in s.layers
            ),
        )
        for s in touchset.sequences
    )
    assert ratio(mesh, replace(touchset, sequences=turned)) == pytest.approx(ratio(mesh, touchset), abs=0.5)


def test_a_mirrored_solid_is_told_apart(solids) -> None:
    """A bar with another on top turned to the left, and its mirror image: widths at either height are the same over all
    yaws, but come in the other order as the known hand turns."""
    lower = trimesh.creation.box([0.060, 0.032, 0.035])
    pair = []
    for side in (1, -1):
        upper = trimesh.creation.box([0.060, 0.032, 0.035])
        upper.apply_transform(trimesh.transformations.rotation_matrix(side * np.deg2rad(50), [0, 0, 1]))
        upper.apply_translation([0, 0, 0.035])
        pair.append(solids.as_mesh(trimesh.util.concatenate([lower, upper]), f"turned{side}"))
    for seed in range(3):
        sets = [touched(m, NOMINAL, 70 + seed, i)[0] for i, m in enumerate(pair)]
        for i, mesh in enumerate(pair):
            ranking = likelihood(TargetModel.from_mesh(mesh), sets)
            assert ranking.best.index == i
            assert ranking.best.probability > 0.9


def test_no_touch_is_no_evidence(meshes) -> None:
    touchset, _ = touched(meshes[0], NOMINAL, 7)
    model = TargetModel.from_mesh(meshes[0])
    dead = changed(
        touchset, left_m=lambda l: np.full_like(l.left_m, np.nan), right_m=lambda l: np.full_like(l.left_m, np.nan)
    )
    cases = (
        dead,
        changed(touchset, stable=lambda l: False),
        changed(touchset, left_m=lambda l: np.zeros(5), right_m=lambda l: np.zeros((2, 3, 4))),
        changed(touchset, aperture_m=lambda l: float("nan")),
        changed(touchset, position_K_m=lambda l: np.zeros(3)),
        replace(touchset, sequences=()),
    )
    for t in cases:
        ranking = likelihood(model, [t])
        assert ranking.best.evidence == 0
        assert ranking.best.fit is None
        assert ranking.best.probability < BY_OUTLINE
        assert not ranking.accepted
        assert "no closure felt" in ranking.reasons[-1]
        assert total(ranking) == pytest.approx(1.0)


def test_one_sided_touches_tell_less(meshes) -> None:
    touchset, _ = touched(meshes[0], NOMINAL, 8)
    single = changed(touchset, left_m=lambda l: np.zeros_like(l.left_m))
    one, both = (likelihood(TargetModel.from_mesh(meshes[0]), [t]).best for t in (single, touchset))
    assert 0 < one.evidence <= 1
    assert one.probability < both.probability


def test_some_dead_taxels_change_little(meshes) -> None:
    touchset, _ = touched(meshes[2], IDEAL, 9)
    rng = np.random.default_rng(0)
    holes = changed(touchset, left_m=lambda l: np.where(rng.random(l.left_m.shape) < 0.05, np.nan, l.left_m))
    assert ratio(meshes[2], holes) == pytest.approx(ratio(meshes[2], touchset), abs=1.0)


def test_more_touches_tell_more(meshes) -> None:
    """Sequence by sequence the right candidate's odds rise and the wrong one's fall, on average over seeds."""
    gain = []
    for seed in range(4):
        touchset, _ = touched(meshes[2], NOMINAL, 80 + seed)
        parts = [replace(touchset, sequences=touchset.sequences[:k]) for k in (1, 3)]
        right, wrong = ([ratio(m, t) for t in parts] for m in (meshes[2], meshes[3]))
        gain.append([right[1] - right[0], wrong[1] - wrong[0]])
    mean = np.mean(gain, axis=0)
    assert mean[0] > 1.0
    assert mean[1] < -1.0


def test_width_evidence_is_the_rigid_width(meshes) -> None:
    """Aperture plus what sank into the gels is the solid's width: closed form for a cylinder."""
    touchset, _ = touched(meshes[0], IDEAL, 2)
    evidence = read_evidence(touchset, TargetModel.from_mesh(meshes[0]).pad)
    for layer in evidence.layers:
        assert layer.width_m == pytest.approx(0.050, abs=1e-4)


def test_bad_input_is_refused(meshes) -> None:
    touchset, _ = touched(meshes[0], IDEAL, 2)
    model = TargetModel.from_mesh(meshes[0])
    with pytest.raises(ParamError, match="at least one"):
        likelihood(model, [])
    with pytest.raises(ParamError, match="one per candidate"):
        likelihood(model, [touchset, touchset])
    lost = replace(touchset.candidate, height_m=float("nan"))
    with pytest.raises(ParamError, match="finite"):
        likelihood(model, [TouchSet(lost, touchset.sequences)])
    with pytest.raises(ParamError, match="odd"):
        LikelihoodParams(bias_steps=4)
    with pytest.raises(ParamError):
        LikelihoodParams(width_sd_m=0.0)


def test_an_object_seen_to_turn_may_lie_at_another_yaw(meshes) -> None:
    """Sequences after a turn of 25 deg that was seen speak less against the target than if nobody had seen it."""
    touchset, _ = touched(meshes[2], NOMINAL, 43)
    turn = np.deg2rad(25.0)
    first, *later = touchset.sequences
    # The object turned by -25 deg between the first sequence and the next: the hand as good as by +25.
    later = [replace(s, layers=tuple(replace(l, yaw_rad=l.yaw_rad - turn) for l in s.layers)) for s in later]
    unseen = replace(touchset, sequences=(first, *later))
    one, *rest = later[0].layers
    seen = replace(later[0], layers=(replace(one, turn_rad=-turn), *rest))
    assert ratio(meshes[2], replace(unseen, sequences=(first, seen, *later[1:]))) > ratio(meshes[2], unseen) + 0.5
    assert observed_turns(replace(unseen, sequences=(first, seen, *later[1:]))) == pytest.approx([0, turn, turn])


def test_parts_of_the_likelihood_alone(meshes) -> None:
    """Outline and height alone do not see a wrong width; widths alone see neither outline nor images."""
    touchset, _ = touched(meshes[2], NOMINAL, 43)
    wrong = tuple(
        replace(s, layers=tuple(replace(l, aperture_m=l.aperture_m + 0.006) for l in s.layers))
        for s in touchset.sequences
    )
    model = TargetModel.from_mesh(meshes[2])
    parts = LikelihoodParams().ablation()
    outline, other = (
        infer_belief(model, [t], parts["outline"]).ranking.best.probability
        for t in (touchset, replace(touchset, sequences=wrong))
    )
    assert outline == pytest.approx(other, abs=1e-6)
    terms = infer_belief(model, [touchset], parts["widths"]).pairs[0].terms
    assert [terms[name] for name in ("mode", "height", "contour", "image")] == [0.0] * 4
    assert terms["width"] > 0.0


def test_probabilities_against_bayes() -> None:
    """Densities under target, twin and any object: (8, 4, 1) and (2, 2, 1); every fourth other object is a twin.

    Target: 0.4 x 8 (the other one 0.75 + 0.25 x 2), 0.4 x 2 (0.75 + 0.25 x 4). None: 0.2 x 1.25 x 1.75.
    """
    p = LikelihoodParams(prior_absent=0.2, twin=0.25)
    against = [log_ratio_to_others(np.log(8), np.log(4 / 8), p), log_ratio_to_others(np.log(2), 0.0, p)]
    shares, absent = probabilities(against, p)
    expected = np.array([0.4 * 8 * 1.25, 0.4 * 2 * 1.75, 0.2 * 1.25 * 1.75])
    np.testing.assert_allclose([*shares, absent], expected / expected.sum())


def test_what_fits_worse_than_a_twin_would_is_the_twin() -> None:
    """Of two whose widths say the same, the one whose images fit better leads by `twin_fit` of what they tell; layers
    count, not sums: 80 nats of four layers and 40 of two fit alike."""
    p = LikelihoodParams()

    def felt(log_ratio: float, layers: float) -> SimpleNamespace:
        return SimpleNamespace(log_ratio=log_ratio, log_twin=-2.0, evidence=layers)

    better, worse = ratios([felt(80.0, 4.0), felt(60.0, 4.0)], p)
    assert better == pytest.approx(2.0 - np.log(p.twin))  # against a twin that fits as well
    assert better - worse == pytest.approx(p.twin_fit * 20.0)
    assert ratios([felt(80.0, 4.0), felt(40.0, 2.0)], p) == pytest.approx([better, better])


@given(
    st.lists(st.tuples(st.floats(-60, 60), st.floats(-20, 20)), min_size=1, max_size=6),
    st.floats(0.05, 0.95),
)
def test_what_a_twin_shares_never_proves_much(candidates, share: float) -> None:
    """However well a candidate fits: its odds against none are at most those against its twin."""
    p = LikelihoodParams(twin=share)
    shares, absent = probabilities([log_ratio_to_others(r, t, p) for r, t in candidates], p)
    assert shares.sum() + absent == pytest.approx(1.0)
    twins = np.array([t for _, t in candidates])
    bound = (1 - p.prior_absent) / (p.prior_absent * share * len(candidates)) * np.exp(-twins)
    assert (shares <= absent * bound * (1 + 1e-9)).all()


def test_a_candidate_nobody_felt_keeps_the_weight_of_its_outline(meshes) -> None:
    """Two look-alikes, one felt a little and fitting worse by its touch: the other is not yet ruled out."""
    felt, _ = touched(meshes[0], NOMINAL, 41, 0)
    twin = replace(felt, candidate=replace(felt.candidate, index=1), sequences=())
    one = replace(felt, sequences=(replace(felt.sequences[0], layers=felt.sequences[0].layers[:1]),))
    ranking = infer_belief(TargetModel.from_mesh(meshes[0]), [one, twin]).ranking
    shares = {m.index: m.probability for m in ranking.matches}
    assert shares[1] > 0.1
    nothing = infer_belief(TargetModel.from_mesh(meshes[0]), [replace(one, sequences=()), twin]).ranking
    assert nothing.matches[0].probability == pytest.approx(nothing.matches[1].probability)


def test_belief_before_any_touch_is_not_sure(meshes) -> None:
    sets = [replace(touched(m, NOMINAL, 20 + i, i)[0], sequences=()) for i, m in enumerate(meshes)]
    belief = infer_belief(TargetModel.from_mesh(meshes[2]), sets)
    assert total(belief.ranking) == pytest.approx(1.0)
    assert not belief.ranking.accepted
