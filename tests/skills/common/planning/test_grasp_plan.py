"""Where a recognised object is taken hold of: where its mesh is held best; where it was felt if the pose is no good."""

from __future__ import annotations

import hashlib
import math

import numpy as np
import pytest
import trimesh

from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_bt.perception.recognition import Fit, Match, PadSpec, TargetModel
from glotouch_bt.perception.touch import Layer, TouchSequence, TouchSet
from glotouch_bt.robot.scene.meshes import Mesh
from glotouch_skills.common.planning.grasp_holds import holds_of
from glotouch_skills.common.planning.grasp_plan import (
    ALTERNATIVES,
    MAX_MISFIT_M,
    STALENESS,
    GraspPlan,
    misfit_m,
    plan_grasp,
)

SHAPE = (35, 20)
LONG, SHORT, HIGH = 0.075, 0.040, 0.060


def mesh_of(solid: trimesh.Trimesh) -> Mesh:
    digest = hashlib.sha256(np.ascontiguousarray(solid.vertices).tobytes()).hexdigest()
    return Mesh("solid", np.array(solid.vertices), np.array(solid.faces), digest)


def block(height_m: float, size_m: tuple[float, float] = (0.05, 0.04)) -> Mesh:
    """A block standing at the origin; centre of mass at half its height."""
    solid = trimesh.creation.box((*size_m, height_m))
    solid.apply_translation([0, 0, 0.5 * height_m])
    return mesh_of(solid)


@pytest.fixture(scope="module")
def bar() -> tuple[Mesh, TargetModel]:
    mesh = block(HIGH, (LONG, SHORT))
    return mesh, TargetModel.from_mesh(mesh, PadSpec())


@pytest.fixture(scope="module")
def plan(bar):
    """Plans; the model counts only where there is a fit."""

    def make(touchset: TouchSet, match: Match, mesh: Mesh, side_gap_m: float = 0.010) -> GraspPlan:
        return plan_grasp(touchset, match, mesh, bar[1], XENSE_GRIPPER, side_gap_m)

    return make


def layer(
    height_m: float,
    x_m: float = 0.0,
    *,
    stable: bool = True,
    left: float = 5e-4,
    right: float = 5e-4,
    aperture_m: float = 0.04,
    position_K_m: tuple[float, float] | None = None,
    yaw_rad: float = 0.0,
) -> Layer:
    maps = np.full(SHAPE, left), np.full(SHAPE, right)
    at = np.array([x_m, 0.0] if position_K_m is None else position_K_m)
    return Layer(height_m, aperture_m, at, yaw_rad, *maps, 10.0, stable)


def matched(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, *, fitted: bool = False) -> Match:
    fit = Fit(yaw, 0.0, 0.0, 1.0, 0.0) if fitted else None
    return Match(0, 1.0, {}, fit, (x, y, yaw), 3.0)


@pytest.fixture
def touched(found):
    def make(*sequences: tuple[Layer, ...]) -> TouchSet:
        candidate = found.box((0.0, 0.0), (0.05, 0.04))
        return TouchSet(candidate, tuple(TouchSequence(np.zeros(2), 0.0, s) for s in sequences))

    return make


# -- nothing is fitted: the closures felt ------------------------------------------------------------------------------


@pytest.mark.parametrize("com_m", [0.02, 0.03, 0.045])
def test_the_layer_at_the_height_of_the_centre_of_mass_wins(plan, touched, com_m: float) -> None:
    heights = (0.02, 0.03, 0.045)
    made = plan(touched(tuple(layer(h) for h in heights)), matched(), block(2 * com_m))
    assert made.source == "felt"
    assert made.position_K_m[2] == com_m
    assert [a.position_K_m[2] for a in made.alternatives] == sorted(
        (h for h in heights if h != com_m), key=lambda h: abs(h - com_m)
    )


def test_the_track_through_the_centre_of_mass_wins_wherever_the_object_stands(plan, touched) -> None:
    """The centre of mass is the mesh's, at the fitted pose: here 20 mm along x."""
    tracks = [(layer(0.03, x),) for x in (0.0, 0.02, -0.02)]
    # the middle sequence is one staler than the last, but 40 mm nearer
    made = plan(touched(*tracks), matched(x=0.02, yaw=1.0), block(0.06))
    assert made.position_K_m[0] == 0.02


def test_of_two_alike_the_later_wins_and_staleness_has_its_price(plan, touched) -> None:
    made = plan(touched((layer(0.0301),), (layer(0.0299),)), matched(), block(0.06))
    assert made.position_K_m[2] == 0.0299
    # A lever that costs more than the staleness of the older one.
    lever = 2 * 0.015 * np.sqrt(1 / STALENESS - 1)
    made = plan(touched((layer(0.03),), (layer(0.03 + 1.05 * lever),)), matched(), block(0.06))
    assert made.position_K_m[2] == 0.03
    made = plan(touched((layer(0.03),), (layer(0.03 + 0.95 * lever),)), matched(), block(0.06))
    assert made.position_K_m[2] > 0.03


@pytest.mark.parametrize("worse", [{"stable": False}, {"left": 0.0}, {"right": 0.0}])
def test_what_does_not_hold_comes_last(plan, touched, worse: dict[str, float]) -> None:
    made = plan(touched((layer(0.03, **worse), layer(0.02))), matched(), block(0.06))
    assert made.position_K_m[2] == 0.02


def test_the_opening_spans_what_was_traced_and_there_are_few_alternatives(plan, touched) -> None:
    made = plan(touched(tuple(layer(0.01 + 0.004 * k) for k in range(9))), matched(), block(0.06), 0.008)
    assert made.opening_m == pytest.approx(0.04 + 0.016)
    assert made.aperture_m == 0.04
    assert len(made.alternatives) == ALTERNATIVES
    assert all(a.alternatives == () for a in made.alternatives)


# -- the mesh at the fitted pose ---------------------------------------------------------------------------------------


def ends(x: float, y: float, yaw: float, aperture_m: float = SHORT - 0.001) -> tuple[Layer, ...]:
    """Three closures across the bar standing at a pose, all near one of its ends."""
    at = np.array([x, y]) + 0.025 * np.array([math.cos(yaw), math.sin(yaw)])
    return tuple(layer(h, position_K_m=tuple(at), yaw_rad=yaw, aperture_m=aperture_m) for h in (0.021, 0.034, 0.047))


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.0, 0.0, 0.0), (0.05, -0.08, 0.7), (-0.06, 0.03, -2.3)])
def test_a_bar_felt_at_one_end_is_held_at_its_middle(plan, touched, bar, x: float, y: float, yaw: float) -> None:
    made = plan(touched(ends(x, y, yaw)), matched(x, y, yaw, fitted=True), bar[0])
    assert made.source == "fitted"
    np.testing.assert_allclose(made.position_K_m, [x, y, 0.5 * HIGH], atol=0.004)
    assert abs(math.remainder(made.yaw_rad - yaw, math.pi)) < 0.01, "the jaws close across the short side"
    assert made.aperture_m == pytest.approx(SHORT, abs=1e-4)
    assert made.opening_m == pytest.approx(SHORT + 0.020, abs=1e-3)
    assert "felt" in {a.source for a in made.alternatives}, "what was reached once is left to do"


@pytest.mark.parametrize("off_rad", [math.radians(25.0), math.radians(90.0)])
def test_a_pose_that_contradicts_what_was_felt_is_not_believed(plan, touched, bar, off_rad: float) -> None:
    """Yaws of the closures differ, so a wrong yaw makes some too wide and others too narrow."""
    wide = SHORT * math.cos(0.3) + LONG * math.sin(0.3)
    felt = (*ends(0.0, 0.0, 0.0), *(layer(0.03, yaw_rad=0.3 * s, aperture_m=wide) for s in (1, 1, -1, -1)))
    right, wrong = (matched(yaw=yaw, fitted=True) for yaw in (0.0, off_rad))
    assert misfit_m(touched(felt), wrong, bar[1]) > MAX_MISFIT_M
    assert plan(touched(felt), wrong, bar[0]).source == "felt"
    assert misfit_m(touched(ends(0.0, 0.0, 0.0)), right, bar[1]) < 1e-4


def test_two_closures_do_not_confirm_a_pose(plan, touched, bar) -> None:
    made = plan(touched(ends(0.0, 0.0, 0.0)[:2]), matched(fitted=True), bar[0])
    assert made.source == "felt"


def test_holds_are_where_faces_are_opposite(bar) -> None:
    """A bar: the best yaw is across the short side, the best place its middle; across corners nearly nothing holds."""
    holds = holds_of(bar[1], np.array([0.0, 0.0, 0.5 * HIGH]), XENSE_GRIPPER, 0.021, 30.0)
    i, j, k = np.unravel_index(int(np.argmax(holds.worth)), holds.worth.shape)
    assert holds.phi_rad[i] == 0.0
    assert abs(holds.l_m[j]) < 0.0024
    assert holds.z_m[k] == pytest.approx(0.5 * HIGH, abs=0.004)
    askew = np.flatnonzero(np.isclose(holds.phi_rad, math.radians(40.0)))[0]
    assert holds.worth[askew].max() < 0.3 * holds.worth.max()
    assert (holds.z_m >= 0.021 - 1e-9).all()


def test_the_fingers_pass_what_overhangs_their_hold() -> None:
    """A post of 30 mm under a slab of 70 mm: the jaws close on 30 mm below and come down 70 mm apart."""
    post, slab = trimesh.creation.box((0.03, 0.03, 0.05)), trimesh.creation.box((0.07, 0.07, 0.02))
    post.apply_translation([0, 0, 0.025])
    slab.apply_translation([0, 0, 0.06])
    model = TargetModel.from_mesh(mesh_of(trimesh.util.concatenate([post, slab])), PadSpec())
    holds = holds_of(model, np.array([0.0, 0.0, 0.045]), XENSE_GRIPPER, 0.021, 30.0)
    j, k = int(np.argmin(np.abs(holds.l_m))), 0
    assert holds.width_m[0, j, k] == pytest.approx(0.03, abs=1e-4)
    assert holds.opening_m[0, j, k] == pytest.approx(0.07, abs=1e-4)
    assert holds.worth[:, :, k].max() == 0.0, "the fingers would meet the slab, the pads nothing"


@pytest.mark.parametrize("height_m", [0.013, 0.014, 0.016, 0.018, 0.020, 0.022, 0.030])
def test_a_low_object_is_held_with_the_lower_half_of_the_pads_or_not_at_all(height_m: float) -> None:
    """The pads' mid-point cannot go below 21 mm; the gel reaches 14 mm below it."""
    mesh = block(height_m)
    model = TargetModel.from_mesh(mesh, PadSpec())
    holds = holds_of(model, np.array([0.0, 0.0, 0.5 * height_m]), XENSE_GRIPPER, 0.021, 30.0)
    assert holds.worth.shape == (len(holds.phi_rad), len(holds.l_m), len(holds.z_m))
    assert (holds.z_m >= 0.021 - 1e-9).all()
    assert (holds.worth.max(initial=0.0) > 0.0) == (height_m >= 0.014)
