"""A robot's YAML file: what it gives, and every fault in one message."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.robot import BadInput, RobotDescription, RobotFile, UnknownName

FILE = shipped_robots()["iiwa14"]
TEXT = FILE.read_text()


def _read(tmp_path: Path, *changes: tuple[str, str]) -> RobotDescription:
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "arm.yaml").write_text(text)
    (tmp_path / "iiwa14.urdf").write_text(FILE.with_suffix(".urdf").read_text())
    return load_robot(str(tmp_path / "arm.yaml"))


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_shipped_robots_are_complete(name: str) -> None:
    robot = load_robot(name)
    assert robot.dof == 7
    assert robot.source
    assert all(j.servo_stiffness_Nm_rad > 0.0 and j.link.capsules for j in robot.joints)


def test_a_file_is_a_robot_as_well(tmp_path: Path) -> None:
    mine = _read(tmp_path, ("robot: KUKA", "robot: MY"), ("stroke_m: 0.085", "stroke_m: 0.05"))
    assert mine.name.startswith("MY")
    assert mine.gripper.stroke_m == 0.05
    assert mine.joints == load_robot("iiwa14").joints


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("  joint3:", "  jiont3:", "joints.jiont3: iiwa14.urdf has no joint 'jiont3'"),
        ("  joint3:", "  jiont3:", "did you mean 'joint3'"),
        ("  joint3:", "  jiont3:", "joints lacks joint3; every joint between base and flange needs an entry"),
        ("  link7:", "  link9:", "capsules lacks link7"),
        ("home_rad: 0.73992293, ", "", "joints.joint2 needs 'home_rad' (position at home, rad)"),
        ("home_rad: 0.73992293", "home_rad: 3.0", "joints.joint2.home_rad = 3 is outside of its range in the URDF"),
        ("home_rad: 0.73992293", "home_rad: 0.2", "deg from straight down"),
        ("servo_stiffness_Nm_rad: 10000.0", "servo_stiffness_Nm_rad: 0", "should be greater than 0"),
        ("stroke_m:", "strok_m:", "gripper has no key 'strok_m'; did you mean 'stroke_m'?"),
        ("stroke_m:", "strok_m:", "gripper needs 'stroke_m' (largest opening between the pads, m)"),
        ("radius_m: 0.095", "radius: 0.095", "needs 'radius_m' (radius, m)"),
        ("mass_kg: 0.704", "mass_kg: heavy", "gripper.mass_kg = 'heavy'"),
        ("robot: KUKA", "robt: KUKA", "the robot needs 'robot'"),
        ("flange: flange", "flange: link4", "the hand needs at least 6 to take any pose"),
        ("urdf: iiwa14.urdf", "urdf: other.urdf", "other.urdf: cannot be read"),
        ("robot: KUKA", "robot: [", "is not YAML"),
    ],
)
def test_a_fault_is_named_with_its_place(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        _read(tmp_path, (old, new))
    assert said in str(caught.value)


@pytest.mark.parametrize("text", ["", "- 1\n", "3\n"])
def test_what_is_no_mapping(text: str, tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(text)
    with pytest.raises(BadInput, match="must be a mapping with robot, source, urdf"):
        load_robot(str(tmp_path / "arm.yaml"))


def test_the_guide_explains_every_key() -> None:
    guide = (Path(__file__).parents[3] / "docs/guides/backend.md").read_text()
    (shown,) = re.findall(r"```yaml\n(robot: .*?)```", guide, re.DOTALL)
    file = yaml.safe_load(shown)
    assert file.keys() == RobotFile.model_fields.keys()
    assert file["gripper"].keys() == yaml.safe_load(TEXT)["gripper"].keys()
    joints = yaml.safe_load(TEXT)["joints"]
    assert all(set(joints[name]) == set(given) for name, given in file["joints"].items())


def test_an_unknown_name_lists_the_shipped_robots() -> None:
    with pytest.raises(UnknownName, match=r"did you mean 'iiwa14'.*rizon4"):
        load_robot("iwa14")
