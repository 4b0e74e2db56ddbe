"""A simulated trial as a message: the same world to the bit, no path, no class, bounded."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import msgspec
import numpy as np
import pytest

import glotouch_backends.trial_message as module
from glotouch_backends.options import WorldOptions
from glotouch_backends.trial_message import pose_numbers, pose_of, trial_message, trial_of_message
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.robot import BadInput, Pose, World

WORLD = load_mission("retrieve").world
OPTIONS = WorldOptions(layout={"a": (0.1, 0.2, 0.3)}, fixed=True)


def message(**changes: object) -> bytes:
    data = msgspec.msgpack.decode(trial_message(WORLD, load_conditions("harsh"), 7, OPTIONS))
    return msgspec.msgpack.encode(data | changes)


def test_a_trial_comes_back_to_the_bit() -> None:
    conditions = load_conditions("harsh")
    with trial_of_message(trial_message(WORLD, conditions, 7, OPTIONS)) as (world, its_conditions, seed, options):
        assert (its_conditions, seed, options) == (conditions, 7, OPTIONS)
        for name in ("probe", "name"):
            assert getattr(world, name) == getattr(WORLD, name)
        for ours, theirs in ((world.container.pose_B_K, WORLD.container.pose_B_K),
                             (world.holder.pose_B_grasp, WORLD.holder.pose_B_grasp)):  # fmt: skip
            assert pose_numbers(ours) == pose_numbers(theirs)
        names = world.objects.names
        assert names == tuple(sorted(p.stem for p in WORLD.objects.folder.glob("*.stl")))
        for name in names:
            files = (w.objects.folder / f"{name}.stl" for w in (world, WORLD))
            assert next(files).read_bytes() == next(files).read_bytes()
        folder = world.objects.folder
        assert folder != WORLD.objects.folder
    assert not folder.exists()


def test_a_quaternion_is_not_normalised_twice() -> None:
    rng = np.random.default_rng(0)
    poses = [Pose(rng.normal(size=3), q / np.linalg.norm(q)) for q in rng.normal(size=(500, 4))]
    assert any(pose_numbers(Pose(p.position_m, p.quat)) != pose_numbers(p) for p in poses)
    assert all(pose_numbers(pose_of(pose_numbers(p))) == pose_numbers(p) for p in poses)


@pytest.mark.parametrize("name", ["../x", "/etc/x", "a/b", "", ".x", "a\0b", "x" * 300])
def test_a_message_names_no_file(name: str) -> None:
    with pytest.raises(BadInput, match="cannot be read"), trial_of_message(message(stl={name: b"x"})):
        pass


@pytest.mark.parametrize(
    "changes",
    [
        {"pose_B_K": [0.0] * 6},
        {"pose_B_K": [0.0] * 7},
        {"pose_B_K": [float("nan")] * 7},
        {"interior_m": [-1.0, 1.0, 1.0]},
        {"seed": -1},
        {"seed": "1"},
        {"folder": "/etc"},
        {"stl": {f"o{i}": b"" for i in range(201)}},
        {"conditions": {"tactile_rate_Hz": 0.0}},
        {"world": 7},
    ],
)
def test_invalid_values_are_refused(changes: dict[str, object]) -> None:
    with pytest.raises(BadInput), trial_of_message(message(**changes)):
        pass


@pytest.mark.parametrize("body", [b"", b"\x80\x04.", b"\x91" * 5000, b"\x81\xa5world\xa2\xff\xfe"])
def test_damaged_bytes_are_refused(body: bytes) -> None:
    with pytest.raises(BadInput, match="cannot be read"), trial_of_message(body):
        pass


def with_objects(folder: Path) -> World:
    return dataclasses.replace(WORLD, objects=dataclasses.replace(WORLD.objects, folder=folder))


def test_the_size_is_bounded_on_both_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    body = message()
    monkeypatch.setattr(module, "MAX_MESSAGE_BYTES", 1000)
    with pytest.raises(BadInput, match="fewer or coarser"):
        trial_message(WORLD, load_conditions("nominal"), 0, OPTIONS)
    with pytest.raises(BadInput, match="at most 1000"), trial_of_message(body):
        pass


def test_missing_objects_are_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such folder"):
        trial_message(with_objects(tmp_path / "none"), load_conditions("nominal"), 0, OPTIONS)
    with pytest.raises(BadInput, match="has no "):
        trial_message(with_objects(tmp_path), load_conditions("nominal"), 0, OPTIONS)


def test_numbers_of_numpy_are_numbers() -> None:
    size = tuple(np.array(WORLD.container.interior_m))
    world = dataclasses.replace(WORLD, container=dataclasses.replace(WORLD.container, interior_m=size))
    conditions = dataclasses.replace(load_conditions("nominal"), force_noise_sd_N=np.float64(0.5))
    with trial_of_message(trial_message(world, conditions, np.int64(3), OPTIONS)) as (back, its, seed, _):  # type: ignore[arg-type]
        assert (back.container.interior_m, its.force_noise_sd_N, seed) == (size, 0.5, 3)
    with pytest.raises(BadInput, match="cannot hold a"):
        trial_message(world, dataclasses.replace(conditions, name=object()), 3, OPTIONS)  # type: ignore[arg-type]
