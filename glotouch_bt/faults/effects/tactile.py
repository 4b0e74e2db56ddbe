"""Faults of the gel pads: depth maps (rows, cols) in metres, left at +y_P and right at -y_P."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.faults.effects.base import Effect, FaultParams, P, param
from glotouch_bt.robot import Observation, TactileFrame


class TouchEffect(Effect[P]):
    """Base of effects that replace or drop a pair of depth maps."""

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        if observation.tactile is None:
            return observation
        frame = self.alter(observation.tactile)
        return observation if frame is observation.tactile else replace(observation, tactile=frame)

    def alter(self, frame: TactileFrame) -> TactileFrame | None:
        """Return the pair of depth maps that is reported instead, or None."""
        raise NotImplementedError


class TouchDeadParams(FaultParams):
    """Parameters of `touch_dead`."""

    share: float = param("Share of the taxels that deliver nothing", default=0.3, gt=0.0, le=1.0)


class TouchDead(TouchEffect[TouchDeadParams]):
    """A fixed set of taxels delivers NaN."""

    def begin(self) -> None:
        """See `Effect`."""
        shape = self.context.description.gripper.pad_shape
        self._left, self._right = (self.context.rng.random(shape) < self.params.share for _ in range(2))

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        nan = np.nan
        return TactileFrame(
            frame.stamp_s, np.where(self._left, nan, frame.left_m), np.where(self._right, nan, frame.right_m)
        )


class TouchFrozen(TouchEffect[FaultParams]):
    """The first pair of maps is repeated with new stamps."""

    def begin(self) -> None:
        """See `Effect`."""
        self._first: TactileFrame | None = None

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        if self._first is None:
            self._first = frame
            return frame
        return replace(self._first, stamp_s=frame.stamp_s)


class TouchDroppedParams(FaultParams):
    """Parameters of `touch_dropped`."""

    share: float = param("Share of the frames that are lost", default=1.0, gt=0.0, le=1.0)


class TouchDropped(TouchEffect[TouchDroppedParams]):
    """Frames are lost."""

    def alter(self, frame: TactileFrame) -> TactileFrame | None:
        """See `TouchEffect`."""
        return None if self.context.rng.random() < self.params.share else frame


class TouchSwapped(TouchEffect[FaultParams]):
    """The maps of the left and the right pad are exchanged."""

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        return TactileFrame(frame.stamp_s, frame.right_m, frame.left_m)


class GelOffsetParams(FaultParams):
    """Parameters of `gel_offset`."""

    left_m: float = param("Added to the left map", unit="m", default=0.0003, ge=-0.002, le=0.002)
    right_m: float = param("Added to the right map", unit="m", default=0.0003, ge=-0.002, le=0.002)


class GelOffset(TouchEffect[GelOffsetParams]):
    """Untouched gel reads a depth: it is swollen, or its reference image is old."""

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        p = self.params
        return TactileFrame(frame.stamp_s, frame.left_m + p.left_m, frame.right_m + p.right_m)
