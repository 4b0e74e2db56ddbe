"""Distances against closed forms, named violations, allowed contacts, retracting from a contact."""

from __future__ import annotations

import fcl
import numpy as np
import pytest

from glotouch_bt.motion import Kinematics, Scene
from glotouch_bt.robot import ParamError, Pose, UnknownName, World
from tests.support.outlines import disc, rectangle

FLOOR_B = -0.2
TIP_BELOW_P, TIP_RADIUS = 0.130, 0.006
FINGER_BELOW_P = 0.016


@pytest.fixture
def scene(kinematics: Kinematics, world: World) -> Scene:
    return Scene(kinematics, world)


def at(kinematics: Kinematics, x_K: float, y_K: float, z_K: float, yaw: float = np.pi) -> np.ndarray:
    return kinematics.ik(Pose.pointing_down((0.6 + x_K, y_K, FLOOR_B + z_K), yaw), kinematics.home)


def first(scene: Scene, q: np.ndarray, aperture_m: float, margin_m: float | None = None) -> str | None:
    """Return the first violation at one posture in words."""
    return next((str(v) for v in scene.violations(q, aperture_m, margin_m)), None)


def distance_m(scene: Scene, part: str, obstacle: str, q: np.ndarray, aperture_m: float) -> float:
    """Signed distance of a part from an obstacle; negative is penetration."""
    body = {p.name: p for p in (*scene._arm_parts, *scene._tool_parts)}[part]
    rotations, centres = scene._placed([body], q[None], aperture_m)
    body.body.setTransform(fcl.Transform(rotations[0, 0], centres[0, 0]))
    return fcl.distance(body.body, scene._obstacles[obstacle].body, scene._request, fcl.DistanceResult())


def test_tip_to_floor_and_wall_closed_form(scene: Scene, kinematics: Kinematics) -> None:
    scene.hold_tool(True)
    for above in (0.05, 0.01, 0.001, -0.002):
        q = at(kinematics, 0.05, -0.17, TIP_BELOW_P + TIP_RADIUS + above)
        assert distance_m(scene, "tip", "floor", q, 0.016) == pytest.approx(above, abs=5e-6)
        assert distance_m(scene, "tip", "wall -y", q, 0.016) == pytest.approx(0.03 - TIP_RADIUS, abs=5e-6)


@pytest.mark.parametrize("aperture", [0.0, 0.03, 0.085])
@pytest.mark.parametrize("yaw", [0.0, np.pi])
def test_fingers_to_walls_closed_form(scene: Scene, kinematics: Kinematics, aperture: float, yaw: float) -> None:
    """x_P along +-x_B; the jaws close along y. Left is at +y_P."""
    q = at(kinematics, 0.0, 0.1, 0.05, yaw)
    side = -1.0 if yaw == 0.0 else 1.0  # y_P in B for a hand pointing down at this yaw
    for finger, sign in (("left finger", side), ("right finger", -side)):
        outer = 0.1 + sign * (0.5 * aperture + 0.007) + 0.007
        assert distance_m(scene, finger, "wall +y", q, aperture) == pytest.approx(0.2 - outer, abs=1e-6)
        assert distance_m(scene, finger, "floor", q, aperture) == pytest.approx(0.05 - FINGER_BELOW_P, abs=1e-6)


def test_links_are_where_the_description_says(scene: Scene, kinematics: Kinematics) -> None:
    """A link capsule's distance from a pillar beside the arm, by hand: point to segment."""
    scene.add_obstacle("ball-like", disc((-0.3, 0.3), 0.02), height_m=0.5)
    q = kinematics.home
    rotations, origins = kinematics.link_placements(q)
    for i, joint in enumerate(kinematics.description.joints[3:6], start=3):
        capsule = joint.link.capsules[0]
        a, b = (origins[i] + rotations[i] @ np.array(p) for p in (capsule.start_m, capsule.end_m))
        points = a + np.linspace(0, 1, 4001)[:, None] * (b - a)
        z = np.clip(points[:, 2], FLOOR_B, FLOOR_B + 0.5)
        side = np.maximum(np.hypot(points[:, 0] - 0.3, points[:, 1] - 0.3) - 0.01, 0.0)
        by_hand = float(np.hypot(side, points[:, 2] - z).min()) - capsule.radius_m
        assert distance_m(scene, joint.link.name, "ball-like", q, 0.0) == pytest.approx(by_hand, abs=3e-4)


def test_violation_names_pair_and_penetration(scene: Scene, kinematics: Kinematics) -> None:
    assert first(scene, kinematics.home, 0.05) is None
    # Its faces lie 0.20 and 0.214 along y, the wall's 0.200 and 0.208: 8 mm is the shortest way out.
    q = at(kinematics, 0.0, 0.18, 0.05)
    assert first(scene, q, 0.04) == "left finger would hit wall +y of the container (penetration 8.0 mm)"
    q = at(kinematics, 0.0, 0.2 - 0.02 - 0.014 - 0.001, 0.05)
    assert first(scene, q, 0.04) == ("left finger would pass wall +y of the container at 1.0 mm (margin 2.0 mm)")
    assert first(scene, q, 0.04, margin_m=0.0) is None
    assert first(scene, q, 0.02) is None


def test_gripper_body_above_a_wall_is_checked(scene: Scene, kinematics: Kinematics) -> None:
    """Fingers inside, low, near a wall: the 0.08 m wall is below the body (0.115 m above P)."""
    q = at(kinematics, 0.0, 0.15, 0.02)
    assert distance_m(scene, "gripper body", "wall +y", q, 0.0) == pytest.approx(0.115 + 0.02 - 0.08, abs=1e-6)


def test_broad_phase_keeps_every_near_pair(scene: Scene, kinematics: Kinematics) -> None:
    """Random postures: `violations` has exactly the pairs whose single distances are below the margin."""
    scene.hold_tool(True)
    scene.add_obstacle("block", rectangle((0.05, 0.1), (0.06, 0.03), 0.6), height_m=0.07)
    rng = np.random.default_rng(3)
    blocked = 0
    for _ in range(60):
        q = at(kinematics, *rng.uniform((-0.14, -0.19, 0.10), (0.14, 0.19, 0.22)), np.pi + rng.uniform(-1, 1))
        distances = {(p, o): distance_m(scene, p, o, q, 0.016) for p in scene.parts for o in scene.obstacles}
        found = {(v.part, v.obstacle) for v in scene.violations(q, 0.016)}
        assert found == {pair for pair, d in distances.items() if d < scene.margin_m}
        blocked += bool(found)
    assert 5 < blocked < 55


def test_obstacles_are_added_and_removed(scene: Scene, kinematics: Kinematics) -> None:
    q = at(kinematics, 0.0, 0.0, 0.05)
    scene.add_obstacle("can", disc((0.0, 0.05), 0.06), height_m=0.06)
    assert distance_m(scene, "left finger", "can", q, 0.0) == pytest.approx(0.05 - 0.03 - 0.014, abs=2e-5)
    assert "can" in str(first(scene, q, 0.085))
    scene.remove_obstacle("can")
    assert first(scene, q, 0.085) is None
    scene.add_obstacle("a", rectangle((0.0, 0.0), (0.02, 0.02)), height_m=0.04)
    scene.clear_obstacles()
    assert "a" not in scene.obstacles


def test_allow_applies_to_one_pair_only(scene: Scene, kinematics: Kinematics) -> None:
    scene.hold_tool(True)
    scene.add_obstacle("can", disc((0.0, 0.0), 0.05), height_m=0.06)
    q = at(kinematics, 0.03, 0.0, 0.02 + TIP_BELOW_P)
    assert str(first(scene, q, 0.016)).startswith("tip would hit can")
    scene.allow("tip", "can")
    # The shaft stands 1 mm from the can: nearer than the margin, and not allowed.
    assert str(first(scene, q, 0.016)).startswith("shaft would pass can")
    scene.allow("tool", "can")
    assert first(scene, q, 0.016) is None
    scene.disallow("tool", "can")
    assert first(scene, q, 0.016) is not None


def test_pickup_must_allow_the_probe_but_not_the_holder(scene: Scene, kinematics: Kinematics, world: World) -> None:
    q = kinematics.ik(world.holder.pose_B_grasp, kinematics.home)
    assert first(scene, q, 0.05) is None
    assert "probe" in str(first(scene, q, 0.015))
    scene.hold_tool(True)
    assert "holder" in str(first(scene, q, 0.016))
    scene.allow("tool", "holder")
    assert first(scene, q, 0.016) is None


def test_part_may_retract_from_a_contact_but_not_come_nearer(scene: Scene, kinematics: Kinematics) -> None:
    scene.hold_tool(True)
    low = TIP_BELOW_P + TIP_RADIUS
    touching, higher = at(kinematics, 0, 0, low + 0.0005), at(kinematics, 0, 0, low + 0.0015)
    deeper = at(kinematics, 0, 0, low - 0.001)
    assert scene.first_violation(np.stack([touching, higher]), 0.016) is None
    found = scene.first_violation(np.stack([touching, deeper]), 0.016)
    assert found is not None
    assert (found.index, found.part, found.obstacle) == (1, "tip", "floor")


def test_invalid_names_and_sizes_are_refused(scene: Scene) -> None:
    with pytest.raises(UnknownName, match="left finger"):
        scene.allow("left fingr", "floor")
    with pytest.raises(UnknownName):
        scene.allow("tip", "candidate 3")
    with pytest.raises(UnknownName):
        scene.remove_obstacle("floor")
    with pytest.raises(ParamError):
        scene.add_obstacle("floor", rectangle((0, 0), (0.1, 0.1)), height_m=0.1)
    with pytest.raises(ParamError):
        scene.add_obstacle("x", [(0, 0), (0.1, 0.1), (0.05, 0.05)], height_m=0.1)
    with pytest.raises(ParamError):
        scene.add_obstacle("x", rectangle((0, 0), (0.1, 0.1)), height_m=0.0)
