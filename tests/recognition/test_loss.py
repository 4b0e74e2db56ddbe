"""The right object has the least loss; evidence that is missing is never made up."""

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.recognition import LossParams, TargetModel, match, rank
from glotouch_bt.recognition.evidence import coupled_probability, read_evidence
from glotouch_bt.recognition.synthetic import HARSH, IDEAL, NOMINAL, acquire
from glotouch_bt.robot import ParamError
from glotouch_bt.touch import TouchSequence


@pytest.fixture(scope="module")
def meshes(solids):
    return [
        solids.cylinder(0.025, 0.070),
        solids.cone(0.032, 0.080),
        solids.box(0.080, 0.040, 0.060),
        solids.box(0.060, 0.045, 0.060),
        solids.sphere(0.032),
    ]


def touched(mesh, disturbance, seed: int, index: int = 0):
    rng = np.random.default_rng(seed)
    pose = (rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(-np.pi, np.pi))
    return acquire(mesh, pose, disturbance, rng, index)


def changed(touchset, **layer):
    sequences = tuple(
        replace(s, layers=tuple(replace(l, **{k: v(l) for k, v in layer.items()}) for l in s.layers))
        for s in touchset.sequences
    )
    return replace(touchset, sequences=sequences)


@pytest.mark.parametrize("disturbance", [NOMINAL, HARSH], ids=["nominal", "harsh"])
@pytest.mark.parametrize("seed", [11, 12])
def test_each_target_finds_itself(meshes, disturbance, seed: int) -> None:
    sets = [touched(m, disturbance, 100 * seed + i, i)[0] for i, m in enumerate(meshes)]
    for i, mesh in enumerate(meshes):
        ranking = rank([match(TargetModel.from_mesh(mesh), t) for t in sets])
        assert ranking.best.index == i, [(m.index, m.loss, m.terms) for m in ranking.matches]


def test_undisturbed_touches_fit_almost_exactly(meshes) -> None:
    for i, mesh in enumerate(meshes):
        m = match(TargetModel.from_mesh(mesh), touched(mesh, IDEAL, i)[0], LossParams().only())
        assert m.loss < 0.25, (i, m.terms)


def test_pose_of_a_box(meshes) -> None:
    """One that squeezes do not move is found within 3 mm and 4 degrees, up to its own symmetry (half a turn)."""
    still = replace(NOMINAL, drift_m=0.0, drift_rad=0.0, turn_rad=0.0)
    for seed in range(4):
        touchset, end = touched(meshes[2], still, seed)
        x, y, yaw = match(TargetModel.from_mesh(meshes[2]), touchset).pose_K_O
        assert np.hypot(x - end[0], y - end[1]) < 3e-3
        assert abs((yaw - end[2] + np.pi / 2) % np.pi - np.pi / 2) < np.deg2rad(4)


def test_pose_of_an_offset_frame(meshes, solids) -> None:
    """Moving the mesh in its file moves pose_K_O, not where the solid is."""
    angle = np.deg2rad(40.0)
    mesh = meshes[3]
    other = solids.moved(mesh, angle, 0.010, -0.020)
    touchset, _ = touched(mesh, IDEAL, 3)
    a = match(TargetModel.from_mesh(mesh), touchset)
    b = match(TargetModel.from_mesh(other), touchset)
    c, s = np.cos(b.pose_K_O[2]), np.sin(b.pose_K_O[2])
    middle = np.array(b.pose_K_O[:2]) + np.array([c * 0.010 + s * 0.020, s * 0.010 - c * 0.020])
    np.testing.assert_allclose(middle, a.pose_K_O[:2], atol=2.5e-3)
    assert b.loss == pytest.approx(a.loss, abs=0.15)


def test_a_hand_turned_by_half_a_turn_feels_the_same(meshes, solids) -> None:
    """Left and right pads swap and columns reverse; loss stays."""
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
    model = TargetModel.from_mesh(mesh)
    a, b = match(model, touchset), match(model, replace(touchset, sequences=turned))
    assert b.loss == pytest.approx(a.loss, abs=1e-3)
    np.testing.assert_allclose(b.pose_K_O[:2], a.pose_K_O[:2], atol=1e-3)


def test_no_touch_is_no_evidence(meshes) -> None:
    touchset, _ = touched(meshes[0], NOMINAL, 7)
    model = TargetModel.from_mesh(meshes[0])
    dead = changed(
        touchset, left_m=lambda l: np.full_like(l.left_m, np.nan), right_m=lambda l: np.full_like(l.left_m, np.nan)
    )
    unstable = changed(touchset, stable=lambda l: False)
    none = replace(touchset, sequences=())
    for t in (dead, unstable, none):
        m = match(model, t)
        assert not np.isfinite(m.loss)
        assert m.evidence == 0
        assert m.fit is None
        ranking = rank([m, m])
        assert not ranking.accepted
        assert "no evidence" in ranking.reasons[0]


def test_one_sided_touches_are_not_enough(meshes) -> None:
    touchset, _ = touched(meshes[0], NOMINAL, 8)
    single = changed(touchset, left_m=lambda l: np.zeros_like(l.left_m))
    m = match(TargetModel.from_mesh(meshes[0]), single)
    assert 0 < m.evidence <= 1
    ranking = rank([m])
    assert not ranking.accepted
    assert "evidence" in ranking.reasons[-1]


def test_some_dead_taxels_change_little(meshes) -> None:
    touchset, _ = touched(meshes[2], IDEAL, 9)
    rng = np.random.default_rng(0)
    holes = changed(touchset, left_m=lambda l: np.where(rng.random(l.left_m.shape) < 0.05, np.nan, l.left_m))
    model = TargetModel.from_mesh(meshes[2])
    assert match(model, holes).loss == pytest.approx(match(model, touchset).loss, abs=0.05)


def test_terms_can_be_switched_off_and_sum_up(meshes) -> None:
    touchset, _ = touched(meshes[2], NOMINAL, 10)
    model = TargetModel.from_mesh(meshes[2])
    full = match(model, touchset)
    assert full.loss == pytest.approx(sum(full.terms.values()))
    assert set(full.terms) == {"width", "image", "depth", "mode", "height", "contour"}
    bare = match(model, touchset, LossParams().only())
    assert bare.terms["image"] == 0
    assert set(bare.terms) == {"width", "image"}
    assert set(match(model, touchset, LossParams.paper("depth", "mode")).terms) == {"width", "image", "depth", "mode"}


def test_scale_is_found_when_it_is_let_free(solids) -> None:
    touchset, _ = touched(solids.cylinder(0.0275, 0.077), IDEAL, 1)
    model = TargetModel.from_mesh(solids.cylinder(0.025, 0.070))
    free = replace(LossParams(), scales=(0.9, 1.0, 1.1), scale_prior=0.1).only()
    m = match(model, touchset, free)
    assert m.fit is not None
    assert m.fit.scale == 1.1


def test_coupled_probability_tells_tracks_from_turns(meshes) -> None:
    tracks, _ = touched(meshes[2], IDEAL, 1)
    turns, _ = touched(meshes[0], IDEAL, 1)
    assert coupled_probability(tracks, LossParams()) > 0.8
    assert coupled_probability(turns, LossParams()) < 0.05


def test_width_evidence_is_the_rigid_width(meshes) -> None:
    """Aperture plus what sank into the gels is the solid's width: closed form for a cylinder."""
    touchset, _ = touched(meshes[0], IDEAL, 2)
    evidence = read_evidence(touchset, TargetModel.from_mesh(meshes[0]).pad, LossParams())
    for layer in evidence.layers:
        assert layer.width_m == pytest.approx(0.050, abs=1e-4)


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(ParamError, match="odd"):
        LossParams(bias_steps=4)
    with pytest.raises(ParamError):
        LossParams(unit_m=0.0)
    with pytest.raises(ParamError):
        LossParams(image=float("nan"))
    with pytest.raises(ParamError, match="depth"):
        LossParams().only("colour")
