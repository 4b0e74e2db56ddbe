"""A simulated robot restored to an earlier state, its own or another's, continues bit-identically."""

from __future__ import annotations

import dataclasses
import sys
from collections import deque
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.mission.checkpoint.codec import decode, encode
from glotouch_bt.robot import (
    HOLD,
    BackendError,
    BadInput,
    Command,
    Conditions,
    GripperTarget,
    Limits,
    Observation,
    SafetyStop,
    SetPayload,
    Tare,
    World,
)
from glotouch_bt.robot.fake import FakeRobot

Drive = Callable[[MujocoRobot], Any]
NOISY = Conditions(
    name="noisy",
    force_noise_sd_N=0.1,
    torque_noise_sd_Nm=0.005,
    force_drift_N_per_sqrt_min=0.2,
    wrench_latency_s=0.012,
    payload_mass_error=0.05,
    payload_com_error_m=0.002,
    aperture_noise_sd_m=1e-5,
    gripper_latency_s=0.03,
    tactile_noise_sd_m=1e-5,
    tactile_dead_fraction=0.01,
    tactile_latency_s=0.025,
)
LAYOUT = {"layout": {"block": (0.03, 0.08, 0.0)}}


def open_robot(world: World, limits: Limits | None = None, seed: int = 3) -> MujocoRobot:
    robot = MujocoBackend(limits=limits).open(world, NOISY, seed, LAYOUT)
    assert isinstance(robot, MujocoRobot)
    return robot


def same_observation(a: Observation, b: Observation) -> bool:
    """To the bit."""
    return encode(a) == encode(b)


def go_on(robot: MujocoRobot, drive: Drive) -> list[Observation]:
    """Squeeze, move, tare, change the payload and request depth maps."""
    driver = drive(robot)
    driver.q = np.array(robot._servo.q)
    driver.pose = driver._forward(driver.q)
    out = [robot.cycle(Command(gripper=GripperTarget(0.030, 0.1, 15.0), tactile=True)) for _ in range(30)]
    robot.start(Tare(0.05))
    driver.line((0.60, 0.09, -0.12), speed_m_s=0.15)
    robot.start(SetPayload(0.2, np.array([0.0, 0.0, 0.05])))
    out += [robot.cycle(Command(tactile=True)) for _ in range(40)]
    return [*out, *driver.observations]


def busy(robot: MujocoRobot, drive: Drive) -> None:
    """Bring the robot into motion with a grip, a tare, a payload, frames and reports pending."""
    driver = drive(robot)
    driver.jaws(0.070, force_N=20.0, time_s=0.2)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.2)
    robot.start(Tare(0.3))
    robot.start(SetPayload(0.1, np.array([0.0, 0.0, 0.04])))
    for _ in range(12):
        robot.cycle(Command(gripper=GripperTarget(0.020, 0.1, 10.0), tactile=True))


def test_another_robot_continues_as_this_one(world: World, drive: Drive) -> None:
    """Through the bytes of a checkpoint, with everything pending and objects asleep."""
    with open_robot(world) as one, open_robot(world) as other:
        busy(one, drive)
        kept = encode(one.snapshot())
        expected = go_on(one, drive)
        other.restore(decode(kept))
        assert same_observation(other.observe(), decode(kept)["parts"]["robot"]["_observation"])
        assert encode(other.snapshot()) == kept
        found = go_on(other, drive)
        assert len(found) == len(expected)
        assert all(same_observation(a, b) for a, b in zip(expected, found, strict=True))
        assert one.true_force.peak_N == other.true_force.peak_N > 0.0
        assert walk(one) == walk(other)


def test_a_robot_is_restored_repeatedly_and_the_snapshot_stays(world: World, drive: Drive) -> None:
    with open_robot(world) as robot:
        busy(robot, drive)
        kept = robot.snapshot()
        before = encode(kept)
        first = go_on(robot, drive)
        robot.restore(kept)
        second = go_on(robot, drive)
        assert all(same_observation(a, b) for a, b in zip(first, second, strict=True))
        assert encode(kept) == before
        robot.restore(kept)
        assert encode(robot.snapshot()) == before


def test_taking_a_snapshot_changes_nothing(world: World, drive: Drive) -> None:
    with open_robot(world) as one, open_robot(world) as other:
        busy(one, drive)
        busy(other, drive)
        other.snapshot()
        assert all(same_observation(a, b) for a, b in zip(go_on(one, drive), go_on(other, drive), strict=True))


def test_changes_of_the_model_are_saved_and_undone(world: World) -> None:
    with open_robot(world) as one, open_robot(world) as other:
        clean = one.snapshot()
        body = one.handles.object_bodies[0]
        container = one.handles.container_body
        one.model.body_pos[container] += 0.01
        one.data.xfrc_applied[body] = [0, 0, 5.0, 0, 0, 0]
        for _ in range(20):
            one.cycle(HOLD)
        other.restore(decode(encode(one.snapshot())))
        assert np.array_equal(other.model.body_pos[container], one.model.body_pos[container])
        assert np.array_equal(one.cycle(HOLD).wrench_S, other.cycle(HOLD).wrench_S)
        assert np.array_equal(one.data.qpos, other.data.qpos)
        other.restore(clean)
        assert other.model.body_pos[container] == pytest.approx(one.model.body_pos[container] - 0.01)
        assert not other.data.xfrc_applied.any()


def test_a_safety_stop_is_restored(world: World, drive: Drive) -> None:
    """The restored robot is still stopped and raises the same message."""
    limits = Limits(hard_force_N=15.0)
    with open_robot(world, limits) as one, open_robot(world, limits) as other:
        driver = drive(one)
        with pytest.raises(SafetyStop) as stopped:
            driver.line((0.58, 0.0, -0.30), speed_m_s=0.2)
        other.restore(decode(encode(one.snapshot())))
        with pytest.raises(SafetyStop) as again:
            other.cycle(HOLD)
        assert str(again.value) == str(stopped.value)


def test_a_foreign_snapshot_is_refused_without_a_change(world: World, folder: Any) -> None:
    with open_robot(world) as robot:
        good = dict(robot.snapshot())
        robot.cycle(HOLD)
        before = encode(robot.snapshot())
        parts: Any = good["parts"]
        for bad in (
            {},
            good | {"backend": "flexiv_xense"},
            good | {"mujoco": "3.1.0"},
            good | {"format": 99},
            good | {"sizes": (1, 2)},
            good | {"data": {}},
            good | {"parts": parts | {"_servo": {}}},
            good | {"parts": parts | {"robot": parts["robot"] | {"_new": 1}}},
        ):
            with pytest.raises(BadInput):
                robot.restore(bad)
        assert encode(robot.snapshot()) == before


def test_a_robot_without_snapshots_refuses_to_restore() -> None:
    robot = FakeRobot()
    assert robot.snapshot() is None
    with pytest.raises(BackendError, match="FakeRobot"):
        robot.restore({})


def walk(robot: MujocoRobot) -> dict[str, bytes]:
    """Return every array and number reachable from a robot's attributes by path, found independently of the snapshot.

    MuJoCo's data is compared through its state vector and several arrays of fixed size.
    """
    found: dict[str, bytes] = {}
    ours = ("glotouch_backends.", "glotouch_bt.")
    seen: set[int] = set()

    def look(path: str, value: Any) -> None:
        if isinstance(value, (bool, int, float, str, bytes, type(None), np.generic)):
            found[path] = repr(value).encode()
        elif isinstance(value, np.ndarray):
            found[path] = str(value.shape).encode() + value.tobytes()
        elif isinstance(value, np.random.Generator):
            found[path] = repr(value.bit_generator.state).encode()
        elif isinstance(value, (tuple, list, deque)):
            found[f"{path}#"] = str(len(value)).encode()
            for i, v in enumerate(value):
                look(f"{path}[{i}]", v)
        elif isinstance(value, dict):
            for k, v in value.items():
                look(f"{path}[{k!r}]", v)
        elif isinstance(value, SafetyStop):
            found[path] = str(value).encode()
        elif isinstance(value, mujoco.MjData):
            state = np.zeros(mujoco.mj_stateSize(robot.model, int(mujoco.mjtState.mjSTATE_INTEGRATION)))
            mujoco.mj_getState(robot.model, value, state, int(mujoco.mjtState.mjSTATE_INTEGRATION))
            found[path] = state.tobytes()
            for name in ("xpos", "xquat", "qacc", "M", "cdof", "sensordata", "cfrc_ext", "tree_asleep", "site_xpos"):
                found[f"{path}.{name}"] = getattr(value, name).tobytes()
        elif isinstance(value, mujoco.MjModel):
            for name in ("actuator_forcerange", "body_mass", "geom_friction", "geom_pos", "eq_data"):
                found[f"{path}.{name}"] = getattr(value, name).tobytes()
        elif (dataclasses.is_dataclass(value) or id(value) not in seen) and type(value).__module__.startswith(ours):
            seen.add(id(value))
            inside = (
                {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
                if dataclasses.is_dataclass(value)
                else vars(value)
            )
            for k, v in inside.items():
                look(f"{path}.{k}", v)

    for name, value in vars(robot).items():
        if name not in ("truth", "world", "description", "_keeper"):
            look(name, value)
    return found


def test_a_new_attribute_of_any_part_is_saved_too(world: World) -> None:
    """No list names it; one of a type that cannot be saved is an error."""
    with open_robot(world) as one, open_robot(world) as other:
        for robot, number in ((one, 5), (other, 6)):
            for name in ("_servo", "_jaws", "_wrist", "_guard", "_tactile", "_reports"):
                vars(getattr(robot, name))["counter"] = number
                vars(getattr(robot, name))["memory"] = np.full(3, float(number))
        other.restore(decode(encode(one.snapshot())))
        assert walk(one) == walk(other)
        assert other._servo.counter == 5  # type: ignore[attr-defined]
        vars(one)["odd"] = sys
        with pytest.raises(Exception, match=r"odd|module|pickle"):
            encode(one.snapshot())
