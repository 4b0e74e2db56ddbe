"""Faults of the gel pads: depth maps (rows, cols) in metres, left at +y_P and right at -y_P."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.faults.effects.base import Effect, FaultParams, param
from glotouch_bt.robot import Observation, TactileFrame


class TouchEffect(Effect):
    """Replaces a pair of depth maps by another, or by none."""

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        if observation.tactile is None:
            return observation
        frame = self.alter(observation.tactile)
        return observation if frame is observation.tactile else replace(observation, tactile=frame)

    def alter(self, frame: TactileFrame) -> TactileFrame | None:
        """What is reported instead of a pair of depth maps."""
        raise NotImplementedError


class DeadParams(FaultParams):
    """Parameters of `touch_dead`."""

    share: float = param("Share of the taxels that deliver nothing", default=0.3, gt=0.0, le=1.0)


class Dead(TouchEffect):
    """Taxels that deliver nothing (NaN), always the same ones."""

    Params = DeadParams
    params: DeadParams

    def begin(self) -> None:
        """See `Effect`."""
        shape = self.scene.description.gripper.pad_shape
        self._left, self._right = (self.scene.rng.random(shape) < self.params.share for _ in range(2))

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        nan = np.nan
        return TactileFrame(
            frame.stamp_s, np.where(self._left, nan, frame.left_m), np.where(self._right, nan, frame.right_m)
        )


class Frozen(TouchEffect):
    """The first pair of maps comes again and again, with new stamps."""

    def begin(self) -> None:
        """See `Effect`."""
        self._first: TactileFrame | None = None

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        if self._first is None:
            self._first = frame
            return frame
        return replace(self._first, stamp_s=frame.stamp_s)


class DroppedParams(FaultParams):
    """Parameters of `touch_dropped`."""

    share: float = param("Share of the frames that are lost", default=1.0, gt=0.0, le=1.0)


class Dropped(TouchEffect):
    """Frames are lost."""

    Params = DroppedParams
    params: DroppedParams

    def alter(self, frame: TactileFrame) -> TactileFrame | None:
        """See `TouchEffect`."""
        return None if self.scene.rng.random() < self.params.share else frame


class Swapped(TouchEffect):
    """The left pad's map is given as the right pad's, and the other way round."""

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        return TactileFrame(frame.stamp_s, frame.right_m, frame.left_m)


class OffsetParams(FaultParams):
    """Parameters of `gel_offset`."""

    left_m: float = param("Added to the left map", unit="m", default=0.0003, ge=-0.002, le=0.002)
    right_m: float = param("Added to the right map", unit="m", default=0.0003, ge=-0.002, le=0.002)


class Offset(TouchEffect):
    """Untouched gel reads a depth: it swelled, or its reference image is old."""

    Params = OffsetParams
    params: OffsetParams

    def alter(self, frame: TactileFrame) -> TactileFrame:
        """See `TouchEffect`."""
        p = self.params
        return TactileFrame(frame.stamp_s, frame.left_m + p.left_m, frame.right_m + p.right_m)
