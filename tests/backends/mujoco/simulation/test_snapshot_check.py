"""A stranger's snapshot never reaches MuJoCo: every array and attribute has its name, type, shape and range."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.mission.checkpoint.codec import encode
from glotouch_bt.robot import BadInput, Command, Conditions, GripperTarget, SetPayload, Tare, World

Change = Callable[[dict[str, Any]], Any]


@pytest.fixture(scope="module")
def robot(world: World) -> Iterator[MujocoRobot]:
    """A robot in the middle of a tare, a payload and a squeeze."""
    with MujocoBackend().open(world, Conditions(tactile_dead_fraction=0.01), 3, {}) as opened:
        assert isinstance(opened, MujocoRobot)
        opened.cycle(Command(gripper=GripperTarget(0.0, 0.1, 15.0), tactile=True))
        opened.start(Tare(1.0))
        opened.start(SetPayload(0.2, np.zeros(3)))
        for _ in range(3):
            opened.cycle(Command(tactile=True))
        yield opened


def put(*path: str, value: Any) -> Change:
    def change(snapshot: dict[str, Any]) -> None:
        place = snapshot
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value(place[path[-1]]) if callable(value) else value

    return change


def with_item(index: Any, item: Any) -> Callable[[Any], Any]:
    def change(array: Any) -> Any:
        array[index] = item
        return array

    return change


INTEGERS = ("body_awake_ind", "dof_awake_ind", "parent_awake_ind", "tree_asleep", "moment_rowadr", "moment_colind",
            "moment_rownnz", "body_awake", "tree_awake")  # fmt: skip
BAD: dict[str, Change] = {
    **{f"{n} {i}": put("data", n, value=with_item(0, i)) for n in INTEGERS for i in (2**31 - 1, -(2**31))},
    **{f"{n} nan": put("data", n, value=with_item(0, np.nan)) for n in ("qpos", "qvel", "qacc_warmstart")},
    "inf": put("data", "qpos", value=with_item(0, np.inf)),
    "no cycle of sleepers": put("data", "tree_asleep", value=lambda a: np.zeros_like(a) + (np.arange(len(a)) == 0)),
    "other type": put("data", "qpos", value=lambda a: a.astype(np.float32)),
    "other shape": put("data", "qpos", value=lambda a: a[:-1]),
    "no array": put("data", "qpos", value=lambda a: a.tolist()),
    "lacks one": lambda s: s["data"].pop("qvel"),
    "an integer of the model": put("model", "body_parentid", value=np.zeros(3, np.int32)),
    "a model array of another shape": put("model", "body_pos", value=np.zeros((2, 3))),
    "nan time": put("time_s", value=float("nan")),
    "late": put("time_s", value=1e300),
    "awake counts": put("awake", value=(10**6, 1, 1, 1)),
    "awake words": put("awake", value=("a", 1, 1, 1)),
    "tripped": put("tripped", value=("force_N", "x", 1.0, 1.0)),
    "no parts": put("parts", value=[]),
    "servo of another size": put("parts", "_servo", "_knots", value=np.zeros((2, 2))),
    "an attribute of another type": put("parts", "robot", "_cycles", value="many"),
    "a huge count": put("parts", "robot", "_cycles", value=10**300),
    "a part that is None": put("parts", "_wrist", "_rng", value=None),
    "another generator": put("parts", "_wrist", "_rng", value=np.random.Generator(np.random.MT19937(1))),
    "a queue without an end": put("parts", "_reports", "_line", value=lambda q: deque(list(q) * 500)),
    "a frame of another size": put("parts", "_tactile", "_frames", value=deque([(0.0, np.zeros(2))])),
    "a tare of words": put("parts", "robot", "_tare", value="soon"),
    "a payload of another size": put("parts", "robot", "_payload_load", value=(0.1, np.zeros(7))),
    "text among numbers": put("parts", "true_force", "peak_N", value="30"),
    "a peak that is not finite": put("parts", "true_force", "peak_N", value=float("nan")),
}


@pytest.mark.parametrize("name", BAD)
def test_a_crafted_world_is_refused_without_a_change(robot: MujocoRobot, name: str) -> None:
    snapshot: Any = copy.deepcopy(dict(robot.snapshot()))
    before = encode(robot.snapshot())
    BAD[name](snapshot)
    with pytest.raises(BadInput, match="saved"):
        robot.restore(snapshot)
    assert encode(robot.snapshot()) == before


def test_an_own_world_is_taken_back_whatever_is_pending(robot: MujocoRobot) -> None:
    for _ in range(8):
        robot.restore(robot.snapshot())
        robot.cycle(Command(tactile=True))
