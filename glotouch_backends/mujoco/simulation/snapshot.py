"""Save and restore the whole state of a simulated robot and its world between two cycles, to the bit.

MuJoCo's state vector is not enough. With sleeping islands a step depends on data of the last one (which bodies sleep,
their positions), and the servo and the payload's feed-forward read the last step's inertia and poses. So every array of
`mjData` with a fixed size is saved; the next step recomputes contacts and constraint rows. Of the model, only the
arrays that the run changed are saved.

Every attribute of the robot's parts is saved unless `FIXED` names it, so that a new attribute is saved too. A test
finds attributes of a type that a checkpoint cannot store.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from glotouch_backends.mujoco.simulation.snapshot_check import (
    require_arrays,
    require_attributes,
    require_counts,
    require_model,
    require_stop,
    require_time,
)
from glotouch_bt.robot import BadInput, SafetyStop, Snapshot

FORMAT = 6
PARTS = ("_servo", "_jaws", "_wrist", "_guard", "_tactile", "_depth", "_taxels", "_reports", "proof", "true_force")
FIXED: Mapping[str, frozenset[str]] = {
    "MujocoRobot": frozenset(
        (
            *("description", "limits", "period_s", "world", "truth", "model", "data", "handles", "trace"),
            *(
                "_s",
                "_warnings",
                "_wrench_now",
                "_probe_now",
                "_joints_now",
                "_pads_now",
                "_keeper",
                "_failed",
                "_closed",
                "_poses",
                "_hand",
                "_filter",
                *PARTS,
            ),
            # views of the arrays that are kept
            *("_rows", "_ctrl_now", "_sensed", "_external_now"),
        )
    ),
    "Servo": frozenset(
        # the last three are views of the arrays that are kept
        ("_model", "_data", "_dof", "_arm_qpos", "_diagonal", "_names", "_scaled", "_torques", "_of_arm")
    ),
    "JawServo": frozenset(("_gripper", "_proof")),
    "WristSensor": frozenset(("_P_in_S", "_proof", "_gain_error", "_cross_talk", "_reach", "_jitter", "_calibrated")),
    "HardLimitGuard": frozenset(("_max_N", "_max_Nm", "_quiet_2", "_rise_s_m", "_samples_ahead", "tripped")),
    "Tactile": frozenset(
        ("_data", "_pads", "_site", "_gel", "_imager", "_meshes", "_rays", "_c", "depth", "taxels", "_proof", "_smooth")
    ),
    "DepthErrors": frozenset(
        (
            "_proof",
            "_pitch",
            "_blur",
            "_blur_sd",
            "_bulge",
            "_hysteresis",
            "_smooth_sd",
            "_bulge_kernel",
            "_smooth_kernel",
            "_gain",
        )
    ),
    "TaxelErrors": frozenset(("_noise_m", "_offset", "_dead")),
    "JawReports": frozenset(("_c", "_proof")),
    "TrueForce": frozenset(("_limit_2",)),
    "AxisProof": frozenset(("_open",)),
}
"""Attributes, by class, that follow from world, conditions, seed and options alone."""

AWAKE = ("nbody_awake", "nparent_awake", "ntree_awake", "nv_awake")
"""Counters of mjData of what is awake."""
BULKY = ("bvh_", "mesh_", "tex_", "hfield_", "skin_", "flex", "names", "paths", "text_")
"""Prefixes of arrays of the model that no run changes and that are too large to compare each time."""
DRAWN_ONLY = ("bvh_active", "bvh_aabb_dyn")
"""Arrays of mjData that only rendering uses."""


class SnapshotStore:
    """Save and restore the state of one robot.

    Args:
        model, data: Those of the robot, as compiled; later changes of the model are part of the state.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._data = model, data
        self._pristine = copy.copy(model)

    def take(self, robot: object) -> Snapshot:
        """Return the state of a robot that has not failed, independent of its later changes."""
        data = self._data
        stop: SafetyStop | None = vars(robot)["_guard"].tripped
        return {
            "backend": "mujoco",
            "format": FORMAT,
            "mujoco": mujoco.__version__,
            "sizes": self._sizes,
            "time_s": float(data.time),
            "awake": tuple(int(getattr(data, n)) for n in AWAKE),
            "data": {n: np.array(getattr(data, n)) for n in self._kept_arrays},
            "model": {n: np.array(getattr(self._model, n)) for n in self._changed()},
            "parts": {name: _attributes(part) for name, part in _parts(robot).items()},
            "tripped": None if stop is None else (stop.quantity, stop.value, stop.limit, stop.stamp_s),
        }

    def put_back(self, robot: object, snapshot: Snapshot) -> None:
        """Restore a snapshot; contacts are known again after the next cycle.

        Raises:
            BadInput: See `Robot.restore`. Nothing was changed.
        """
        self._require_fitting(robot, snapshot)
        kept: Any = snapshot
        for name in self._changed():
            getattr(self._model, name)[...] = getattr(self._pristine, name)
        for name, array in kept["model"].items():
            getattr(self._model, name)[...] = array
        mujoco.mj_resetData(self._model, self._data)
        for name, array in kept["data"].items():
            getattr(self._data, name)[...] = array
        self._data.time = kept["time_s"]
        for name, count in zip(AWAKE, kept["awake"], strict=True):
            setattr(self._data, name, count)
        for name, part in _parts(robot).items():
            _set_attributes(part, kept["parts"][name])
        tripped = kept["tripped"]
        vars(robot)["_guard"].tripped = None if tripped is None else SafetyStop(*tripped)

    def _require_fitting(self, robot: object, snapshot: Snapshot) -> None:
        given = (snapshot.get("backend"), snapshot.get("format"), snapshot.get("mujoco"))
        ours = ("mujoco", FORMAT, mujoco.__version__)
        if given != ours:
            raise BadInput(
                f"the saved world is of backend {given[0]}, format {given[1]}, MuJoCo {given[2]}; "
                f"this robot has {ours[0]}, format {ours[1]}, MuJoCo {ours[2]}"
            )
        kept: Any = snapshot
        for name in ("sizes", "time_s", "awake", "data", "model", "parts", "tripped"):
            if name not in kept:
                raise BadInput(f"the saved world has no {name}: it is damaged")
        if kept["sizes"] != self._sizes:
            raise BadInput("the saved world has other objects or parts than the one this robot was opened with")
        require_arrays(kept["data"], {n: getattr(self._data, n) for n in self._kept_arrays}, self._model)
        require_model(kept["model"], self._model)
        require_counts(kept["awake"], self._model)
        require_time(kept["time_s"])
        require_stop(kept["tripped"])
        parts = _parts(robot)
        if not (isinstance(kept["parts"], dict) and kept["parts"].keys() == parts.keys()):
            raise BadInput("the saved state of the robot's parts is of another version")
        gripper = vars(robot)["description"].gripper
        for name, part in parts.items():
            now = {n: vars(part)[n] for n in _names(part)}
            require_attributes(kept["parts"][name], now, type(part).__name__, gripper)

    @property
    def _sizes(self) -> tuple[int, ...]:
        names = ("nq", "nv", "nu", "nbody", "ngeom", "nsensordata", "nmesh")
        return tuple(int(getattr(self._model, n)) for n in names)

    @cached_property
    def _kept_arrays(self) -> tuple[str, ...]:
        """Names of the arrays of mjData with a fixed size; the others live from step to step."""
        fresh = mujoco.MjData(self._model)
        return tuple(n for n in _arrays(fresh) if n not in DRAWN_ONLY and _is_view(fresh, n))

    @cached_property
    def _comparable(self) -> tuple[str, ...]:
        return tuple(n for n in _arrays(self._model) if not n.startswith(BULKY) and getattr(self._model, n).size)

    def _changed(self) -> list[str]:
        """Return the names of the model's arrays that differ from the compiled ones."""
        now, then = self._model, self._pristine
        return [n for n in self._comparable if not np.array_equal(getattr(now, n), getattr(then, n))]


def _parts(robot: object) -> dict[str, object]:
    return {"robot": robot, **{n: getattr(robot, n) for n in PARTS}}


def _arrays(thing: object) -> list[str]:
    return [n for n in dir(thing) if not n.startswith("_") and isinstance(getattr(thing, n), np.ndarray)]


def _is_view(data: mujoco.MjData, name: str) -> bool:
    """Return False for an empty array and for one that is created at each access (the list of awake islands)."""
    return bool(np.shares_memory(getattr(data, name), getattr(data, name)))


def _names(part: object) -> set[str]:
    return vars(part).keys() - FIXED[type(part).__name__]


def _attributes(part: object) -> dict[str, object]:
    return {n: copy.deepcopy(vars(part)[n]) for n in sorted(_names(part))}


def _set_attributes(part: object, kept: Mapping[str, Any]) -> None:
    for name, value in kept.items():
        now = vars(part)[name]
        fits = isinstance(now, np.ndarray) and isinstance(value, np.ndarray) and now.shape == value.shape
        if fits and now.flags.writeable and now.dtype == value.dtype:
            now[...] = value  # in place: there may be views of it
        else:
            setattr(part, name, copy.deepcopy(value))
