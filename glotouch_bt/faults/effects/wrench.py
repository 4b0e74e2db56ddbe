"""Faults of the wrist force sensor, on its blocks (n, 6): force N then torque Nm, in S.

They change what is reported, not what is felt: a device that watches its own sensor below the seam goes on doing so.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np

from glotouch_bt.faults.effects.base import Effect, FaultParams, Scene, param
from glotouch_bt.robot import Array, Observation, Request, Tare, Ticket

Triple = tuple[float, float, float]


class WrenchEffect(Effect):
    """Replaces the block of wrenches by another."""

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        wrench = self.alter(observation.wrench_S, observation.stamp_s)
        return observation if wrench is observation.wrench_S else replace(observation, wrench_S=wrench)

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """The block (n, 6) that is reported instead; must not write into the one given."""
        raise NotImplementedError


class Off(WrenchEffect):
    """The line is dead: every component reads exactly zero."""

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.zeros_like(wrench_S)


class Stuck(WrenchEffect):
    """The last sample before the fault is repeated."""

    def begin(self) -> None:
        """See `Effect`."""
        self._last = np.array(self.scene.sensed.wrench_S[-1])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.tile(self._last, (len(wrench_S), 1))


class GarbageParams(FaultParams):
    """Parameters of `wrench_garbage`."""

    kind: Literal["nan", "inf", "huge"] = param("What stands in the samples", default="nan")
    share: float = param("Share of the samples that are garbage", default=1.0, gt=0.0, le=1.0)


class Garbage(WrenchEffect):
    """Samples that no sensor measured."""

    Params = GarbageParams
    params: GarbageParams
    _VALUES: ClassVar[dict[str, float]] = {"nan": float("nan"), "inf": float("inf"), "huge": 1e9}

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        hit = self.scene.rng.random(len(wrench_S)) < self.params.share
        if not hit.any():
            return wrench_S
        out = wrench_S.copy()
        out[hit] = self._VALUES[self.params.kind]
        return out


class AddedEffect(WrenchEffect):
    """Something is added inside the sensor: a tare taken while the fault lasts takes it out again."""

    def begin(self) -> None:
        """See `Effect`."""
        self._start_s = self.scene.sensed.now_s
        self._tared = np.zeros(6)

    def added(self, since_s: Array) -> Array:
        """(n, 6) or (6,) what is added to samples so long after the beginning (n, 1)."""
        raise NotImplementedError

    def tared(self) -> None:
        """See `Effect`."""
        self._tared = np.array(np.broadcast_to(self.added(self._since(self.scene.sensed.stamp_s[-1:])), (1, 6))[0])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.asarray(wrench_S + (self.added(self._since(stamp_s)) - self._tared))

    def _since(self, stamp_s: Array) -> Array:
        return np.asarray(stamp_s - self._start_s)[:, None]


class BiasParams(FaultParams):
    """Parameters of `wrench_bias`."""

    force_N: Triple = param("Added force (x, y, z) in S", unit="N", default=(0.0, 0.0, 3.0))
    torque_Nm: Triple = param("Added torque (x, y, z) in S", unit="Nm", default=(0.0, 0.0, 0.0))


class Bias(AddedEffect):
    """A constant is added, until the next tare."""

    Params = BiasParams
    params: BiasParams

    def added(self, since_s: Array) -> Array:
        """See `AddedEffect`."""
        return np.array([*self.params.force_N, *self.params.torque_Nm])


class DriftParams(FaultParams):
    """Parameters of `wrench_drift`."""

    rate_N_s: Triple = param("Force per second (x, y, z) in S", unit="N/s", default=(0.2, 0.0, 0.2))


class Drift(AddedEffect):
    """A ramp is added that begins at zero with the fault; a tare begins it anew."""

    Params = DriftParams
    params: DriftParams

    def added(self, since_s: Array) -> Array:
        """See `AddedEffect`."""
        return np.asarray(since_s * np.array([*self.params.rate_N_s, 0.0, 0.0, 0.0]))


class ScaleParams(FaultParams):
    """Parameters of `wrench_scale`."""

    factor: float = param("Every component is multiplied by this", default=0.3, ge=-10.0, le=10.0)


class Scale(WrenchEffect):
    """Wrong gain."""

    Params = ScaleParams
    params: ScaleParams

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.asarray(wrench_S * self.params.factor)


class NoiseParams(FaultParams):
    """Parameters of `wrench_noise`."""

    force_sd_N: float = param("Standard deviation of each force component", unit="N", default=1.0, ge=0.0, le=100.0)
    torque_sd_Nm: float = param("The same of each torque", unit="Nm", default=0.05, ge=0.0, le=100.0)


class Noise(WrenchEffect):
    """White noise is added."""

    Params = NoiseParams
    params: NoiseParams

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        noise = self.scene.rng.standard_normal(wrench_S.shape)
        noise[:, :3] *= self.params.force_sd_N
        noise[:, 3:] *= self.params.torque_sd_Nm
        return np.asarray(wrench_S + noise)


class DelayParams(FaultParams):
    """Parameters of `wrench_delay`."""

    delay_s: float = param("How much later each sample is reported", unit="s", default=0.05, gt=0.0, le=5.0)


class Delay(WrenchEffect):
    """Samples come late; until the line is full, the first one is repeated."""

    Params = DelayParams
    params: DelayParams

    def begin(self) -> None:
        """See `Effect`."""
        rows = self.scene.sensed.wrench_S
        late = max(1, round(self.params.delay_s * len(rows) / self.scene.period_s))
        self._line = np.tile(rows[-1], (late, 1))

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        line = np.concatenate([self._line, wrench_S])
        self._line = line[len(wrench_S) :]
        return line[: len(wrench_S)]


class IntermittentParams(FaultParams):
    """Parameters of `wrench_intermittent`."""

    lost: float = param("Share of the blocks that are lost", default=0.3, gt=0.0, le=1.0)
    reads: Literal["held", "zero"] = param("What stands in a lost block: the last sample, or zeros", default="held")


class Intermittent(WrenchEffect):
    """A loose contact: whole blocks are lost."""

    Params = IntermittentParams
    params: IntermittentParams

    def begin(self) -> None:
        """See `Effect`."""
        self._last = np.array(self.scene.sensed.wrench_S[-1])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        if self.scene.rng.random() >= self.params.lost:
            self._last = np.array(wrench_S[-1])
            return wrench_S
        return np.tile(self._last, (len(wrench_S), 1)) if self.params.reads == "held" else np.zeros_like(wrench_S)


class SaturationParams(FaultParams):
    """Parameters of `wrench_saturation`."""

    force_N: float = param("Largest component of force that is reported", unit="N", default=1.0, gt=0.0, le=1000.0)
    torque_Nm: float = param("Largest component of torque", unit="Nm", default=0.1, gt=0.0, le=1000.0)


class Saturation(WrenchEffect):
    """Components are clipped."""

    Params = SaturationParams
    params: SaturationParams

    def __init__(self, params: Any, scene: Scene) -> None:
        super().__init__(params, scene)
        self._most = np.array([params.force_N] * 3 + [params.torque_Nm] * 3)

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.clip(wrench_S, -self._most, self._most)


class SignFlip(WrenchEffect):
    """Every component has the wrong sign: action for reaction."""

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return -wrench_S


class FrameFlipParams(FaultParams):
    """Parameters of `wrench_frame_flip`."""

    yaw_rad: float = param("Turn of the reported axes about z_S", unit="rad", default=float(np.pi / 2), ge=-7.0, le=7.0)


class FrameFlip(WrenchEffect):
    """The sensor is said to be mounted otherwise than it is: its axes are turned about z_S."""

    Params = FrameFlipParams
    params: FrameFlipParams

    def __init__(self, params: Any, scene: Scene) -> None:
        super().__init__(params, scene)
        c, s = np.cos(params.yaw_rad), np.sin(params.yaw_rad)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        self._turn = np.block([[turn, np.zeros((3, 3))], [np.zeros((3, 3)), turn]])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.asarray(wrench_S @ self._turn.T)


class _DoneAfter:
    """A ticket that says done after so many polls without anything having been done."""

    error: str | None = None

    def __init__(self, polls: int) -> None:
        self._left = polls

    @property
    def done(self) -> bool:
        """True once it was asked often enough."""
        self._left -= 1
        return self._left < 0


class StaleTare(Effect):
    """Tares are acknowledged and not carried out: what was tared before stays."""

    def request(self, request: Request) -> Ticket | None:
        """See `Effect`."""
        if not isinstance(request, Tare):
            return None
        self.acts.times += 1
        return _DoneAfter(max(1, round(request.duration_s / self.scene.period_s)))
