"""Check a snapshot against the robot that it is to be restored to, before MuJoCo reads any of it.

A checkpoint may come from a stranger. MuJoCo uses the integers of its state as indices without a check, and a number
that is not finite spreads through every later step. So every array must have the name, type, shape and range of the
compiled model, and every attribute of the robot's parts the structure that it has now.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from glotouch_backends.mujoco.control import PendingPayload, PendingTare
from glotouch_backends.mujoco.sensing import PairPress
from glotouch_bt.robot import BadInput, GelImages, Gripper, SetPayload, TactileFrame, Tare

MAX_TIME_S = 1e6
"""Latest simulated time of a snapshot. Source: ten times the longest mission."""
MAX_QUEUE = 1000
"""Maximum number of delayed reports or frames in transit: one per control period over 10 s of latency."""
MAY_BE_NAN = ("left_m", "right_m")
"""Depth maps: NaN marks a dead taxel."""
UNBOUNDED = ("_solved",)
"""Numbers that may be infinite: the jaws when the gel was solved last, before the first time."""
MIN_AWAKE_STEPS = 10
"""MuJoCo's count of steps before a tree may sleep (mjMINAWAKE); `tree_asleep` counts them from below -1."""
CHANGED_BY_RUNS = frozenset(("actuator_forcerange", "body_pos", "body_quat"))
"""Arrays of the model that a run changes: the jaws' force limit and the place of the container."""
STEP_COUNTS = ("solver_niter", "solver_nnz", "solver_fwdinv")
"""Statistics of the last step; no step reads them."""


def index_ranges(model: mujoco.MjModel) -> dict[str, tuple[int, int]]:
    """Return the smallest and largest valid value of the integers of mjData that steps read."""
    return {
        "body_awake": (-1, 1),
        "body_awake_ind": (0, model.nbody - 1),
        "parent_awake_ind": (0, model.nbody - 1),
        "dof_awake_ind": (0, model.nv - 1),
        "tree_asleep": (-1 - MIN_AWAKE_STEPS, model.ntree - 1),
        "tree_awake": (0, 1),
        "eq_active": (0, 1),
    }


def require_arrays(given: object, now: Mapping[str, np.ndarray[Any, Any]], model: mujoco.MjModel) -> None:
    """Require the arrays of mjData to fit those of the compiled world.

    Raises:
        BadInput: A name, type, shape or value does not.
    """
    if not isinstance(given, dict) or given.keys() != now.keys():
        raise BadInput("the saved world has other arrays than the one this robot was opened with")
    ranges = index_ranges(model)
    for name, array in given.items():
        _require_like(array, now[name], name)
        if array.dtype.kind == "f" or name in STEP_COUNTS:
            continue
        if name not in ranges:
            if not np.array_equal(array, now[name]):
                raise BadInput(f"the saved world's {name} differs from that of the compiled model")
        elif array.size and not (ranges[name][0] <= array.min() and array.max() <= ranges[name][1]):
            raise BadInput(f"the saved world's {name} is outside {ranges[name][0]} .. {ranges[name][1]}")
    asleep = np.flatnonzero(given["tree_asleep"] >= 0)
    if not np.array_equal(np.sort(given["tree_asleep"][asleep]), asleep):  # MuJoCo walks along the cycle to its start
        raise BadInput("the saved world's sleeping bodies form no cycles")


def require_model(given: object, model: mujoco.MjModel) -> None:
    """Require the changed arrays of the model to be those that runs change; raises as `require_arrays`."""
    if not isinstance(given, dict) or not given.keys() <= CHANGED_BY_RUNS:
        raise BadInput("the saved world changes arrays of the model that no run changes")
    for name, array in given.items():
        _require_like(array, getattr(model, name), name)


def require_counts(given: object, model: mujoco.MjModel) -> None:
    """Require the counts of what is awake (bodies, parents, trees, degrees of freedom); raises as `require_arrays`."""
    most = (model.nbody, model.nbody, model.ntree, model.nv)
    if not (
        isinstance(given, tuple)
        and len(given) == len(most)
        and all(type(n) is int and 0 <= n <= m for n, m in zip(given, most, strict=True))
    ):
        raise BadInput(f"the saved world's counts of what is awake are {given!r}, beyond {most}")


def require_time(given: object) -> None:
    """Require a simulated time; raises as `require_arrays`."""
    if not (isinstance(given, float) and 0.0 <= given <= MAX_TIME_S):
        raise BadInput(f"the saved world's time is {given!r}, not a number in 0 .. {MAX_TIME_S:g} s")


def require_stop(given: object) -> None:
    """Require a safety stop's values or None; raises as `require_arrays`."""
    if given is not None:
        _Structure({}).require(given, ("force_N", 0.0, 0.0, 0.0), "tripped")


def require_attributes(given: object, now: Mapping[str, Any], part: str, gripper: Gripper) -> None:
    """Require the attributes of a part of the robot to have the structure that they have now.

    Args:
        given: The saved attributes.
        now: The present ones.
        part: Name of the part.
        gripper: The hand; it has the shapes of depth maps and images.

    Raises:
        BadInput: An attribute is missing, or is of another type, shape or kind, or not finite.
    """
    if not isinstance(given, dict):
        raise BadInput(f"the saved state of {part} is damaged")
    odd = sorted(map(str, given.keys() ^ now.keys()))
    if odd:
        raise BadInput(f"the saved state of {part} is of another version ({', '.join(odd)})")
    frame = TactileFrame(0.0, np.zeros(gripper.pad_shape), np.zeros(gripper.pad_shape))
    pixels = np.zeros((*(gripper.camera.shape if gripper.camera else (0, 0)), 3), dtype=np.uint8)
    images = GelImages(0.0, pixels, pixels)
    structure = _Structure(
        {
            "_tare": PendingTare(Tare(1.0), 1),
            "_payload": PendingPayload(SetPayload(0.1, np.zeros(3)), 1),
            "_payload_load": (0.0, np.zeros(3)),
            "_up_at_tare": np.zeros(3),
            "_press": PairPress(frame.left_m, frame.right_m, 0.0, 0.0),
            "_frames": (0.0, frame),
            "_images": (0.0, images),
            "tactile": frame,
            "images": images,
            "error": "",
        }
    )
    for name, value in given.items():
        structure.require(value, now[name], f"{part}.{name}")


class _Structure:
    """Compare values with present ones.

    Args:
        examples: Values of the attributes that may be None or an empty queue at times, by name.
    """

    def __init__(self, examples: Mapping[str, object]) -> None:
        self._examples = examples

    def require(self, given: Any, now: Any, where: str) -> None:
        """Require the same structure; raises as `require_attributes`."""
        name = where.rsplit(".", 1)[-1].partition("[")[0]
        optional = name in self._examples
        if given is None and (now is None or optional):
            return
        if now is None:
            if not optional:
                raise BadInput(f"the saved world's {where} is a {type(given).__name__}, not None")
            now = self._examples[name]
        if isinstance(now, np.ndarray):
            _require_like(given, now, where, may_be_nan=name in MAY_BE_NAN)
        elif isinstance(now, bool | np.bool_ | str):
            self._require_class(given, (bool, np.bool_) if not isinstance(now, str) else (str,), where)
        elif isinstance(now, int | float | np.number):
            self._require_class(given, (int, float, np.number), where)
            if not (abs(given) <= 2**53 or name in UNBOUNDED):
                raise BadInput(f"the saved world's {where} is {given}")
        else:
            self._require_class(given, (type(now),), where)
            self._require_parts(given, now, where, name)

    def _require_parts(self, given: Any, now: Any, where: str, name: str) -> None:
        if isinstance(now, deque):
            example = now[0] if now else self._examples.get(name)
            if given.maxlen != now.maxlen or len(given) > MAX_QUEUE or (given and example is None):
                raise BadInput(f"the saved world's {where} has {len(given)} items")
            for i, item in enumerate(given):
                self.require(item, example, f"{where}[{i}]")
        elif isinstance(now, tuple):
            if len(given) != len(now):
                raise BadInput(f"the saved world's {where} has {len(given)} items, not {len(now)}")
            for i, (g, n) in enumerate(zip(given, now, strict=True)):
                self.require(g, n, f"{where}[{i}]")
        elif isinstance(now, np.random.Generator):
            self._require_class(given.bit_generator, (type(now.bit_generator),), where)
        elif dataclasses.is_dataclass(now):
            for f in dataclasses.fields(now):
                self.require(getattr(given, f.name), getattr(now, f.name), f"{where}.{f.name}")

    def _require_class(self, given: object, kinds: tuple[type, ...], where: str) -> None:
        if not isinstance(given, kinds):
            raise BadInput(f"the saved world's {where} is a {type(given).__name__}, not a {kinds[0].__name__}")


def _require_like(given: object, now: np.ndarray[Any, Any], name: str, *, may_be_nan: bool = False) -> None:
    """Require an array of the same type and shape, of finite numbers."""
    if not (isinstance(given, np.ndarray) and given.dtype == now.dtype and given.shape == now.shape):
        raise BadInput(f"the saved world's {name} is not {now.dtype} of shape {now.shape}")
    if given.dtype.kind == "f" and not may_be_nan and not np.isfinite(given).all():
        raise BadInput(f"the saved world's {name} holds numbers that are not finite")
