"""World and conditions files: shipped ones against the numbers of the specification, faults at their places."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read.library import shipped_root
from glotouch_bt.mission.read.worlds import conditions_name, load_conditions, load_world
from glotouch_bt.mission.spec.findings import MissionFaults
from glotouch_bt.robot import BadInput, Conditions
from glotouch_bt.robot.scene import AXES

WORLD = (shipped_root() / "worlds" / "container_five.yaml").read_text()


def test_the_shipped_world() -> None:
    world = load_world("container_five")
    assert world.container.pose_B_K.position_m.tolist() == [0.6, 0.0, -0.2]
    assert world.container.interior_m == (0.3, 0.4, 0.08)
    down = world.holder.pose_B_grasp
    assert down.rotation[:, 2] == pytest.approx([0, 0, -1])
    ball_bottom = down.position_m[2] - world.probe.grasp_to_tip_m - world.probe.tip_radius_m
    table = world.container.pose_B_K.position_m[2] - world.container.wall_m
    assert 0.005 < ball_bottom - table < 0.03, "the ball hangs a little above the table"
    gap = (
        np.abs(down.position_m[1])
        - world.holder.half_m[1]
        - 0.5 * world.container.interior_m[1]
        - world.container.wall_m
    )
    assert gap > 0.05, "the holder stands clear of the container"
    assert sorted(p.stem for p in world.objects.folder.glob("*.stl")) == [
        "apple",
        "nailong",
        "train",
        "truck",
        "wukong",
    ]


def test_the_shipped_conditions() -> None:
    """Spot values of the specification's table, in SI."""
    assert load_conditions("ideal") == Conditions(name="ideal")
    nominal, harsh = load_conditions("nominal"), load_conditions("harsh")
    assert (nominal.force_noise_sd_N, harsh.force_noise_sd_N) == (0.05, 0.15)
    assert (nominal.aperture_bias_m, harsh.aperture_bias_m) == ((-0.4e-3, 0.4e-3), (-1e-3, 1e-3))
    assert (nominal.tactile_dead_fraction, harsh.tactile_dead_fraction) == (0.005, 0.03)
    assert (nominal.object_mass_kg, harsh.object_mass_kg) == ((0.15, 0.40), (0.06, 0.20))
    assert (nominal.registration_sd_deg, harsh.registration_sd_deg) == (0.2, 0.6)


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("wall_m: 0.008", "wal_m: 0.008", "8:3", "did you mean 'wall_m'"),
        ("wall_m: 0.008", "wall_m: -1", "8:11", "positive"),
        ("interior_m: [0.30, 0.40, 0.08]", "interior_m: [300, 400, 80]", "7:15", "must be in metres, up to 3 each"),
        ("min_gap_m: 0.030", "min_gap_m: 30", "15:14", "must be <= 1"),
        ("expected: 5", "names: [apple, train, apple]", "14:25", "'apple' is listed twice"),
        ("interior_m: [0.30, 0.40, 0.08]", "interior_m: [0.30, 0.40]", "7:15", "interior_m"),
        ("yaw_deg: 0}", "yaw_deg: east}", "6:55", "must be a number"),
        ("folder: ../objects", "folder: ../nowhere", "13:11", "not a folder with .stl"),
        ("expected: 5", "expected: 4", "14:13", "but 5 are chosen"),
        ("expected: 5", "names: [apple, wukng]", "14:18", "did you mean 'wukong'"),
        ("holder:", "hoder:", "9:1", "did you mean 'holder'"),
    ],
)
def test_faults_of_worlds(old: str, new: str, place: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "objects").symlink_to(shipped_root() / "objects")
    (tmp_path / "worlds").mkdir()
    path = tmp_path / "worlds" / "w.yaml"
    assert old in WORLD
    path.write_text(WORLD.replace(old, new, 1))
    with pytest.raises(MissionFaults) as e:
        load_world(str(path))
    assert any(str(f).startswith(f"{path}:{place}: ") and words in str(f) for f in e.value.findings), str(e.value)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("name: x\nforce_noise_N: 1\n", "2:1", "did you mean 'force_noise_sd_N'"),
        ("name: x\nforce_noise_sd_N: loud\n", "2:19", "force_noise_sd_N"),
        ("name: x\naperture_bias_m: [1, -1]\n", "2:18", "(low, high)"),
        ("name: x\ntactile_rate_Hz: 0\n", "2:18", "positive"),
        ("force_noise_sd_N: 1\n", "1:1", "'name'"),
        ("- 1\n", "1:1", "mapping"),
    ],
)
def test_faults_of_conditions(text: str, place: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(text)
    with pytest.raises(BadInput) as e:
        load_conditions(str(path))
    assert f"{path}:{place}: " in str(e.value)
    assert words in str(e.value)


def test_a_profile_with_changed_fields() -> None:
    found = load_conditions("nominal+gel_blur_m=0.0015+object_scale=0.98+jaw_force_offset_N=-1,1")
    assert (found.gel_blur_m, found.object_scale, found.jaw_force_offset_N) == (0.0015, (0.98, 0.98), (-1.0, 1.0))
    assert found.name == "nominal+gel_blur_m=0.0015+object_scale=0.98+jaw_force_offset_N=-1,1"
    assert found.axes_set() == {"gel_blur_m", "object_scale", "jaw_force_offset_N"}
    assert replace(found, **{n: getattr(Conditions(), n) for n in found.axes_set()}, name="nominal") == load_conditions(
        "nominal"
    )
    assert conditions_name("some/where/mine.yaml+gel_blur_m=0.0015") == "mine+gel_blur_m=0.0015"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("nominal+gel_blur_mm=1.5", "did you mean 'gel_blur_m'"),
        ("nominal+gel_blur_m=much", "a number, or LOW,HIGH"),
        ("nominal+gel_blur_m=-1", "finite"),
        ("nominal+gel_blur_m=0.001,0.002", "one number, not a range"),
        ("nominal+object_scale=1.01,0.99", "(low, high)"),
        ("nominal+object_scale=0", "positive"),
        ("nominal+gel_blur_m=0.001+gel_blur_m=0.002", "given twice"),
        ("nominl+gel_blur_m=0.001", "nominal"),
    ],
)
def test_faults_of_changed_fields(given: str, words: str) -> None:
    with pytest.raises(BadInput) as e:
        load_conditions(given)
    assert words in str(e.value)


def test_the_realistic_profile_is_nominal_with_every_axis() -> None:
    nominal, realistic = load_conditions("nominal"), load_conditions("realistic")
    assert realistic.axes_set() == set(AXES)
    for f in fields(Conditions):
        if f.name not in (*AXES, "name", "object_mass_kg"):
            assert getattr(realistic, f.name) == getattr(nominal, f.name)
    assert not nominal.axes_set()
    assert not load_conditions("harsh").axes_set()


def test_a_mission_in_another_world(tmp_path: Path) -> None:
    """A shipped name, or a file beside the working folder; the saved mission names the world that was used."""
    shipped = load_mission("retrieve", world="close_five")
    assert (shipped.world.objects.min_gap_m, shipped.document["world"]) == (0.010, "worlds/close_five.yaml")
    own = tmp_path / "mine.yaml"
    own.write_text(
        (shipped_root() / "worlds" / "lying_five.yaml")
        .read_text()
        .replace("../objects", str(shipped_root() / "objects"))
    )
    mine = load_mission("retrieve", world=str(own))
    assert (mine.world.objects.stance, mine.document["world"]) == ("any", str(own))
    with pytest.raises(MissionFaults, match="unknown world 'close_fife'"):
        load_mission("retrieve", world="close_fife")
