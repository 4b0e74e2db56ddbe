"""The chain of a URDF: equal to Pinocchio's own reader, and every fault in one message."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.motion import Kinematics
from glotouch_bt.robot import BadInput, Pose, UnknownName
from glotouch_bt.robot.definition.urdf import read_chain

ROBOTS = sorted(shipped_robots())
URDF = shipped_robots()["iiwa14"].with_suffix(".urdf").read_text()


def _chain(tmp_path: Path, *changes: tuple[str, str], base: str = "base", flange: str = "flange"):
    text = URDF
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "arm.urdf").write_text(text)
    return read_chain(tmp_path / "arm.urdf", base, flange)


@pytest.mark.parametrize("name", ROBOTS)
def test_kinematics_and_limits_are_those_that_pinocchio_reads(name: str) -> None:
    description = load_robot(name)
    ours = Kinematics(description)
    theirs = pin.buildModelFromUrdf(str(shipped_robots()[name].with_suffix(".urdf")))
    data, flange = theirs.createData(), theirs.getFrameId("flange")
    np.testing.assert_array_equal(ours.lower, theirs.lowerPositionLimit)
    np.testing.assert_array_equal(ours.upper, theirs.upperPositionLimit)
    np.testing.assert_array_equal(ours.velocity, theirs.velocityLimit)
    np.testing.assert_array_equal([j.torque_Nm for j in description.joints], theirs.effortLimit)
    rng = np.random.default_rng(5)
    for _ in range(20):
        q = rng.uniform(ours.lower, ours.upper)
        pin.framesForwardKinematics(theirs, data, q)
        pose_B_P = Pose.from_matrix(data.oMf[flange].translation, data.oMf[flange].rotation) @ (
            description.gripper.pose_E_P
        )
        ours_B_P = ours.fk(q)
        np.testing.assert_allclose(ours_B_P.position_m, pose_B_P.position_m, atol=1e-12)
        np.testing.assert_allclose(ours_B_P.rotation, pose_B_P.rotation, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_masses_and_inertias_are_those_that_pinocchio_reads(name: str) -> None:
    theirs = pin.buildModelFromUrdf(str(shipped_robots()[name].with_suffix(".urdf")))
    for joint, inertia in zip(load_robot(name).joints, list(theirs.inertias)[1:], strict=True):
        xx, yy, zz, xy, xz, yz = joint.link.inertia_kgm2
        np.testing.assert_allclose(inertia.inertia, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], atol=1e-12)
        np.testing.assert_allclose(inertia.lever, joint.link.com_m, atol=1e-12)
        assert inertia.mass == joint.link.mass_kg


def test_a_turned_inertial_frame_is_turned_back(tmp_path: Path) -> None:
    turned = _chain(tmp_path, ('<origin xyz="0 0 0.1"/>', '<origin xyz="0 0 0.1" rpy="1.5707963267948966 0 0"/>'))
    assert turned.joints[0].link.inertia_kgm2 == pytest.approx((0.0639, 0.0155, 0.0639, 0.0, 0.0, 0.0), abs=1e-12)


def test_fixed_joints_at_the_end_are_joined(tmp_path: Path) -> None:
    tool = '<joint name="t" type="fixed"><origin xyz="0 0.01 0.1" rpy="0 0 1"/><parent link="flange"/><child link="e"/>'
    chain = _chain(tmp_path, ("</robot>", f'{tool}</joint><link name="e"/></robot>'), flange="e")
    np.testing.assert_allclose(chain.pose_last_E.position_m, [0.0, 0.01, 0.146])
    assert chain.pose_last_E.yaw_rad == pytest.approx(1.0)


LIMIT = '<limit lower="-2.967" upper="2.967" velocity="1.4835" effort="320"/>'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (LIMIT, "", "joint 'joint1': its <limit> needs lower (smallest position, rad), upper"),
        (' effort="320"', "", "joint 'joint1': its <limit> needs effort (largest torque, Nm)"),
        ('lower="-2.967"', 'lower="-170"', "are they in degrees?"),
        ('lower="-2.967"', 'lower="3"', "its lower limit 3 must be below its upper limit 2.967"),
        ('velocity="1.4835"', 'velocity="0"', "velocity = 0 must be positive"),
        ('effort="320"', 'effort="much"', "limit effort = 'much' must be a finite number"),
        ('effort="320"', 'effort="nan"', "must be a finite number"),
        ('name="joint1" type="revolute"', 'name="joint1" type="continuous"', "'joint1' is continuous, but must be"),
        ('name="joint1" type="revolute"', 'name="joint1" type="prismatic"', "'joint1' is prismatic, but must be"),
        ('name="joint3" type="revolute"', 'name="joint3" type="fixed"', "is fixed and comes before joint 'joint4'"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', "its axis is zero"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 1"/>', "must be three numbers"),
        ('<mass value="5.5"/>', "", "link 'link1' needs <inertial> with <mass> and <inertia>"),
        ('<mass value="5.5"/>', '<mass value="-1"/>', "its mass -1 kg must be positive"),
        ('ixx="0.0639"', 'ixx="0.9"', "no body has the principal moments of inertia"),
        ('<origin xyz="0 0 0.16"/>', '<origin xyz="0 0 160"/>', "lengths are in m"),
        ('<link name="flange"/>', '<link name="flange"><inertial/></link>', "add the mass to link 'link7'"),
    ],
)
def test_a_fault_is_named_with_its_place(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        _chain(tmp_path, (old, new))
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "arm.urdf"))


def test_all_faults_are_in_one_message(tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        _chain(tmp_path, (' effort="320"', ""), ('<mass value="4"/>', ""))
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot", "is not XML"),
        ("<sdf/>", "begins with <sdf>"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot/>', "defines XML entities"),
    ],
)
def test_what_is_no_urdf(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(BadInput, match=said):
        read_chain(tmp_path / "arm.urdf", "base", "flange")


def test_unknown_links(tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="did you mean 'flange'"):
        _chain(tmp_path, flange="flnge")
    with pytest.raises(BadInput, match="no joints lead from base 'link3' to flange 'link1'"):
        _chain(tmp_path, base="link3", flange="link1")
