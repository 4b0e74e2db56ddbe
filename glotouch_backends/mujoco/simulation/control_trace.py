"""Recording of a run's control inputs, to repeat its solver steps with nothing else around them.

The initial state, every control vector, and the jaws' force limits (the only part of the model that a run changes)
determine the run. If the replay does not end in the same state to the bit, something else moved the world.
"""

from __future__ import annotations

import copy
import time

import mujoco
import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.robot.simulation import BareSteps

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the state (n,) that determines the next step, without caches: positions, velocities, warm start, time."""
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


class ControlTrace:
    """Recording of controls from its creation on; costs about 80 bytes a step and two copies a chunk.

    Args:
        model, data: The world, before its first step; both are copied.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._start = copy.copy(model), copy.copy(data)
        self._controls: list[Array] = []
        self._limits: list[bytes] = []

    def add(self, controls: Array, force_limits: Array) -> None:
        """Record a chunk before its steps: controls (steps, nu) and `actuator_forcerange` (nu, 2)."""
        self._controls.append(controls.copy())
        limits = force_limits.tobytes()  # equal bytes are kept once
        self._limits.append(self._limits[-1] if self._limits and limits == self._limits[-1] else limits)

    def replay(self, data: mujoco.MjData) -> BareSteps:
        """Repeat the steps in a copy of the world: only the copies of the controls and `mj_step`.

        Args:
            data: End state of the run; not changed.
        """
        model, fresh, step = copy.copy(self._model), copy.copy(self._start), mujoco.mj_step
        limits_now, ctrl_now = model.actuator_forcerange, fresh.ctrl
        # prepare the rows, and the limits if they change before them, outside the measured loop
        arrays = {limits: np.frombuffer(limits).reshape(limits_now.shape) for limits in self._limits}
        work = [
            (list(rows), arrays[limits] if i == 0 or limits is not self._limits[i - 1] else None)
            for i, (rows, limits) in enumerate(zip(self._controls, self._limits, strict=True))
        ]
        cpu, began = time.process_time(), time.perf_counter()
        for rows, limits in work:
            if limits is not None:
                limits_now[:] = limits
            for row in rows:
                ctrl_now[:] = row
                step(model, fresh)
        wall_s, cpu_s = time.perf_counter() - began, time.process_time() - cpu
        same = np.array_equal(state_of(model, fresh), state_of(model, data))
        return BareSteps(sum(len(rows) for rows, _ in work), wall_s, cpu_s, bool(same))
