"""World and conditions files: shipped ones against the numbers of the specification, faults at their places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.mission.read.library import shipped_root
from glotouch_bt.mission.read.worlds import load_conditions, load_world
from glotouch_bt.mission.spec.findings import MissionFaults
from glotouch_bt.robot import BadInput, Conditions

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
