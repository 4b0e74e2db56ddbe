"""Guards of readings that are within every limit but carry no signal."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from glotouch_bt.robot import Command, GuardTripped, Observation, TactileFrame
from glotouch_bt.robot.fake import FakeRobot
from glotouch_bt.robot.supervision.limits import SupervisionLimits
from tests.robot.supervision.supervised import Device, spin, supervised


def test_wrench_stuck__a_noisy_sensor_freezes() -> None:
    frozen: list[np.ndarray[Any, Any]] = []

    def freeze(seen: Observation) -> Observation:
        frozen.append(np.tile(seen.wrench_S[-1], (10, 1)))
        return dataclasses.replace(seen, wrench_S=frozen[0])

    robot, _ = supervised(Device(freeze, since=800, noise_N=0.05))
    with pytest.raises(GuardTripped, match="wrench_stuck") as trip:
        spin(robot, 900)
    assert trip.value.stamp_s < 8.0 + 0.06


def test_wrench_stuck__a_loose_contact() -> None:
    """Three of ten blocks repeat the last sample."""

    def loose(seen: Observation) -> Observation:
        lost = round(seen.now_s * 100) % 10 in (0, 3, 6)
        return dataclasses.replace(seen, wrench_S=np.tile(seen.wrench_S[-1], (10, 1))) if lost else seen

    robot, found = supervised(Device(loose, since=800, noise_N=0.05))
    with pytest.raises(GuardTripped, match="wrench_stuck") as trip:
        spin(robot, 1000)
    assert trip.value.stamp_s < 8.3
    assert sum(not f.fatal for f in found) == SupervisionLimits().tolerated


def test_wrench_stuck__a_clipped_component() -> None:
    def clip(seen: Observation) -> Observation:
        wrench = seen.wrench_S.copy()
        wrench[:, 2] = np.minimum(wrench[:, 2] + 9.0, 1.0)
        return dataclasses.replace(seen, wrench_S=wrench)

    robot, _ = supervised(Device(clip, since=800, noise_N=0.05))
    with pytest.raises(GuardTripped, match="Fz stand still"):
        spin(robot, 900)


@pytest.mark.parametrize(("noise_N", "noted"), [(0.15, False), (1.0, True)])
def test_wrench_noise__is_only_recorded(noise_N: float, noted: bool) -> None:
    robot, found = supervised(Device(noise_N=noise_N))
    spin(robot, 1000)
    assert {f.guard for f in found} == ({"wrench_noise"} if noted else set())
    assert not any(f.fatal for f in found)
    assert len(found) < 12, "once a second"


@pytest.mark.parametrize("noise_m", [2e-5, 0.0])
def test_tactile_frozen__noisy_maps_repeat(noise_m: float) -> None:
    """Repeated maps of noisy pads are frozen; those of noise-free pads are not."""
    rng = np.random.default_rng(3)
    frames = [noise_m * rng.standard_normal((2, 35, 20)) for _ in range(30)]
    count = [0]

    def pads(seen: Observation) -> Observation:
        count[0] += 1
        left, right = frames[min(count[0], 29)]
        return dataclasses.replace(seen, tactile=TactileFrame(seen.now_s, left, right))

    robot, found = supervised(Device(pads))
    if noise_m == 0.0:
        spin(robot, 100, Command(tactile=True))
        assert found == []
        return
    spin(robot, 29, Command(tactile=True))
    with pytest.raises(GuardTripped, match="tactile_frozen"):
        spin(robot, 4, Command(tactile=True))


def test_wrench_stuck__a_noise_free_sensor_is_never_stuck() -> None:
    def pressed(seen: Observation) -> Observation:
        """Load and unload without noise, as an ideal simulation does."""
        wrench = np.zeros((10, 6))
        wrench[:, 2] = 5.0 * np.clip(np.sin(seen.stamp_s), 0.0, 0.9)
        return dataclasses.replace(seen, wrench_S=wrench)

    robot, found = supervised(Device(pressed))
    spin(robot, 3000)
    assert found == []


def test_tactile_stale__requested_maps_do_not_arrive() -> None:
    device = FakeRobot(frame_rate_Hz=1e-3)
    robot, _ = supervised(device)
    robot.cycle(Command(tactile=True))  # the only frame for a thousand seconds
    spin(robot, 100)
    with pytest.raises(GuardTripped, match="tactile_stale"):
        spin(robot, 25, Command(tactile=True))


@pytest.mark.parametrize(
    ("value", "share", "fatal"), [(np.nan, 0.03, False), (np.nan, 0.6, True), (np.inf, 0.01, True)]
)
def test_tactile_dead__dead_pads_but_not_single_taxels(value: float, share: float, fatal: bool) -> None:
    def spoil(seen: Observation) -> Observation:
        left = np.zeros((35, 20))
        left.ravel()[: round(share * left.size)] = value
        return dataclasses.replace(seen, tactile=TactileFrame(seen.now_s, left, np.zeros((35, 20))))

    robot, found = supervised(Device(spoil))
    if not fatal:
        spin(robot, 100, Command(tactile=True))
        assert found == []
        return
    with pytest.raises(GuardTripped, match="tactile_dead"):
        spin(robot, 100, Command(tactile=True))


def test_tactile_stale__the_first_map_may_be_old() -> None:
    """A device first delivers its last map, which may be minutes old."""

    def old(seen: Observation) -> Observation:
        if seen.tactile is None:
            return seen
        return dataclasses.replace(seen, tactile=dataclasses.replace(seen.tactile, stamp_s=0.0))

    robot, found = supervised(Device(old, since=300, until=303))
    spin(robot, 300)
    spin(robot, 50, Command(tactile=True))
    assert found == []
    robot, _ = supervised(Device(old, since=300))
    spin(robot, 300)
    with pytest.raises(GuardTripped, match="tactile_stale"):
        spin(robot, 50, Command(tactile=True))
