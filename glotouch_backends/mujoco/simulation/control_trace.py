"""What a run told the solver, so that the same steps can be done again with nothing round them.

The whole state at the start, every control vector, and the jaws' force limits (the one part of the model that a run
changes) decide all that follows: a replay that does not end in the same state bit for bit means that something else
moved the world.
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
    """(n,) everything the next step depends on but the caches: positions, velocities, warm start, controls, time."""
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


class ControlTrace:
    """Remembers from its making on; costs some 80 bytes a step and two copies a chunk.

    Args:
        model, data: The world, before its first step; both are copied.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._start = copy.copy(model), copy.copy(data)
        self._controls: list[Array] = []
        self._limits: list[Array] = []

    def add(self, controls: Array, force_limits: Array) -> None:
        """Keep a chunk: controls (steps, nu) and `actuator_forcerange` (nu, 2) that its steps are going to use."""
        self._controls.append(controls.copy())
        if not self._limits or not np.array_equal(self._limits[-1], force_limits):
            self._limits.append(force_limits.copy())
        else:
            self._limits.append(self._limits[-1])

    def replay(self, data: mujoco.MjData) -> BareSteps:
        """Do the same steps in a copy of the world: nothing but the controls' copy and `mj_step`.

        Args:
            data: Where the run has come to; not changed.
        """
        model, fresh, step = copy.copy(self._model), copy.copy(self._start), mujoco.mj_step
        limits_now, ctrl_now = model.actuator_forcerange, fresh.ctrl
        limits_now[:] = self._limits[0] if self._limits else limits_now
        # everything but the steps is made beforehand: the rows, and whether the limits change before them
        work = [
            (list(rows), limits if i == 0 or limits is not self._limits[i - 1] else None)
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
