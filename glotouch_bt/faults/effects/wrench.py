"""Faults of the wrist force sensor, applied to its blocks (n, 6): force N, then torque Nm, in S.

They alter what is reported. A device that watches its own sensor internally is not affected.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from glotouch_bt.faults.effects.base import Effect, EffectContext, FaultParams, P, param
from glotouch_bt.robot import Array, Observation, Request, Tare, Ticket

MAX_ADDED = 1000.0
"""Largest component of a force (N), a torque (Nm) or a rate (N/s) that a fault adds: beyond any wrist sensor."""
Added = Annotated[float, Field(ge=-MAX_ADDED, le=MAX_ADDED)]
Triple = tuple[Added, Added, Added]


class WrenchEffect(Effect[P]):
    """Base of effects that alter the block of wrenches."""

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        wrench = self.alter(observation.wrench_S, observation.stamp_s)
        return observation if wrench is observation.wrench_S else replace(observation, wrench_S=wrench)

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """Return the block (n, 6) that is reported instead; do not write into the one given."""
        raise NotImplementedError


class WrenchOff(WrenchEffect[FaultParams]):
    """The connection is dead: every component reads exactly zero."""

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.zeros_like(wrench_S)


class WrenchStuck(WrenchEffect[FaultParams]):
    """The last sample before the fault is repeated."""

    def begin(self) -> None:
        """See `Effect`."""
        self._last = np.array(self.context.sensed.wrench_S[-1])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.tile(self._last, (len(wrench_S), 1))


class WrenchGarbageParams(FaultParams):
    """Parameters of `wrench_garbage`."""

    kind: Literal["nan", "inf", "huge"] = param("Content of the samples", default="nan")
    share: float = param("Share of the samples that are garbage", default=1.0, gt=0.0, le=1.0)


class WrenchGarbage(WrenchEffect[WrenchGarbageParams]):
    """Samples are invalid numbers."""

    _VALUES: ClassVar[dict[str, float]] = {"nan": float("nan"), "inf": float("inf"), "huge": 1e9}

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        hit = self.context.rng.random(len(wrench_S)) < self.params.share
        if not hit.any():
            return wrench_S
        out = wrench_S.copy()
        out[hit] = self._VALUES[self.params.kind]
        return out


class WrenchOffsetEffect(WrenchEffect[P]):
    """Base of effects that add a wrench inside the sensor; a tare during the fault removes it."""

    def begin(self) -> None:
        """See `Effect`."""
        self._start_s = self.context.sensed.now_s
        self._tared = np.zeros(6)

    def added(self, since_s: Array) -> Array:
        """Return the added wrench, (n, 6) or (6,), at times (n, 1) since the start of the fault."""
        raise NotImplementedError

    def tared(self) -> None:
        """See `Effect`."""
        self._tared = np.array(np.broadcast_to(self.added(self._since(self.context.sensed.stamp_s[-1:])), (1, 6))[0])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.asarray(wrench_S + (self.added(self._since(stamp_s)) - self._tared))

    def _since(self, stamp_s: Array) -> Array:
        return np.asarray(stamp_s - self._start_s)[:, None]


class WrenchBiasParams(FaultParams):
    """Parameters of `wrench_bias`."""

    force_N: Triple = param("Added force (x, y, z) in S", unit="N", default=(0.0, 0.0, 3.0))
    torque_Nm: Triple = param("Added torque (x, y, z) in S", unit="Nm", default=(0.0, 0.0, 0.0))


class WrenchBias(WrenchOffsetEffect[WrenchBiasParams]):
    """A constant is added, until the next tare."""

    def added(self, since_s: Array) -> Array:
        """See `WrenchOffsetEffect`."""
        return np.array([*self.params.force_N, *self.params.torque_Nm])


class WrenchDriftParams(FaultParams):
    """Parameters of `wrench_drift`."""

    rate_N_s: Triple = param("Force per second (x, y, z) in S", unit="N/s", default=(0.2, 0.0, 0.2))


class WrenchDrift(WrenchOffsetEffect[WrenchDriftParams]):
    """A ramp is added that starts at zero; a tare restarts it."""

    def added(self, since_s: Array) -> Array:
        """See `WrenchOffsetEffect`."""
        return np.asarray(since_s * np.array([*self.params.rate_N_s, 0.0, 0.0, 0.0]))


class WrenchScaleParams(FaultParams):
    """Parameters of `wrench_scale`."""

    factor: float = param("Every component is multiplied by this", default=0.3, ge=-10.0, le=10.0)


class WrenchScale(WrenchEffect[WrenchScaleParams]):
    """Every component is multiplied by a wrong gain."""

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.asarray(wrench_S * self.params.factor)


class WrenchNoiseParams(FaultParams):
    """Parameters of `wrench_noise`."""

    force_sd_N: float = param("Standard deviation of each force component", unit="N", default=1.0, ge=0.0, le=100.0)
    torque_sd_Nm: float = param("Standard deviation of each torque", unit="Nm", default=0.05, ge=0.0, le=100.0)


class WrenchNoise(WrenchEffect[WrenchNoiseParams]):
    """White noise is added."""

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        noise = self.context.rng.standard_normal(wrench_S.shape)
        noise[:, :3] *= self.params.force_sd_N
        noise[:, 3:] *= self.params.torque_sd_Nm
        return np.asarray(wrench_S + noise)


class WrenchDelayParams(FaultParams):
    """Parameters of `wrench_delay`."""

    delay_s: float = param("Delay of each sample", unit="s", default=0.05, gt=0.0, le=5.0)


class WrenchDelay(WrenchEffect[WrenchDelayParams]):
    """Samples are delayed; until the delay line is full, the last sample before the fault is repeated."""

    def begin(self) -> None:
        """See `Effect`."""
        rows = self.context.sensed.wrench_S
        late = max(1, round(self.params.delay_s * len(rows) / self.context.period_s))
        self._line = np.tile(rows[-1], (late, 1))

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        line = np.concatenate([self._line, wrench_S])
        self._line = line[len(wrench_S) :]
        return line[: len(wrench_S)]


class WrenchIntermittentParams(FaultParams):
    """Parameters of `wrench_intermittent`."""

    lost: float = param("Share of the blocks that are lost", default=0.3, gt=0.0, le=1.0)
    reads: Literal["held", "zero"] = param("Content of a lost block: the last sample, or zeros", default="held")


class WrenchIntermittent(WrenchEffect[WrenchIntermittentParams]):
    """A loose contact: whole blocks are lost."""

    def begin(self) -> None:
        """See `Effect`."""
        self._last = np.array(self.context.sensed.wrench_S[-1])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        if self.context.rng.random() >= self.params.lost:
            self._last = np.array(wrench_S[-1])
            return wrench_S
        return np.tile(self._last, (len(wrench_S), 1)) if self.params.reads == "held" else np.zeros_like(wrench_S)


class WrenchSaturationParams(FaultParams):
    """Parameters of `wrench_saturation`."""

    force_N: float = param("Largest reported force component", unit="N", default=1.0, gt=0.0, le=1000.0)
    torque_Nm: float = param("Largest reported torque component", unit="Nm", default=0.1, gt=0.0, le=1000.0)


class WrenchSaturation(WrenchEffect[WrenchSaturationParams]):
    """Components are clipped."""

    def __init__(self, params: WrenchSaturationParams, context: EffectContext) -> None:
        super().__init__(params, context)
        self._max = np.array([params.force_N] * 3 + [params.torque_Nm] * 3)

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.clip(wrench_S, -self._max, self._max)


class WrenchSignFlip(WrenchEffect[FaultParams]):
    """Every component has the wrong sign."""

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return -wrench_S


class WrenchFrameFlipParams(FaultParams):
    """Parameters of `wrench_frame_flip`."""

    yaw_rad: float = param("Rotation of the axes about z_S", unit="rad", default=float(np.pi / 2), ge=-7.0, le=7.0)


class WrenchFrameFlip(WrenchEffect[WrenchFrameFlipParams]):
    """The sensor is configured with a wrong mounting: its axes are rotated about z_S."""

    def __init__(self, params: WrenchFrameFlipParams, context: EffectContext) -> None:
        super().__init__(params, context)
        c, s = np.cos(params.yaw_rad), np.sin(params.yaw_rad)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        self._rotation = np.block([[turn, np.zeros((3, 3))], [np.zeros((3, 3)), turn]])

    def alter(self, wrench_S: Array, stamp_s: Array) -> Array:
        """See `WrenchEffect`."""
        return np.asarray(wrench_S @ self._rotation.T)


class _DelayedTicket:
    """A ticket that is done after a number of polls, although nothing was done."""

    error: str | None = None

    def __init__(self, polls: int) -> None:
        self._polls_left = polls

    @property
    def done(self) -> bool:
        """True after the last poll."""
        self._polls_left -= 1
        return self._polls_left < 0


class StaleTare(Effect[FaultParams]):
    """Tares are acknowledged and not executed."""

    def request(self, request: Request) -> Ticket | None:
        """See `Effect`."""
        if not isinstance(request, Tare):
            return None
        self.actions.count += 1
        return _DelayedTicket(max(1, round(request.duration_s / self.context.period_s)))
