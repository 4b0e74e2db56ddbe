"""The two tactile sensors: pairs of depth maps taken together, in metres; missing and late frames.

A read takes as long as the sensor's own processing. Reads therefore run concurrently with the loop, and only while
frames are requested. Gel images are read on request only, in the same call as the depth map.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from ..clock import Clock
from ..faults import DeviceFault, vendor_call
from ..frames import Array, depth_map_m, gel_image
from ..messages import HandLimits, Images, Maps

LEFT, RIGHT = 0, 1
MAX_SAME_CLOCK_S = 1.0
"""A stamp this near our clock, or this machine's calendar time, is on that clock; others are shifted by the smallest
delay seen. The vendor does not document the clock."""
MAX_PAIR_S = 0.04
"""Largest difference between the stamps of a pair. Source: one frame at the slower of the rates in use."""
MAX_MISSING_S = 1.0
"""No frame for this long while frames are requested is a fault. Source: ours."""
MAX_UNREQUESTED_S = 0.2
"""The reader ends after this time without a request. Source: ours."""
POLL_S = 0.005
"""Pause between two reads."""


def open_sensor(sdk: Any, serial: str) -> Any:
    """Open a sensor by serial number and take its reference: nothing may touch the pads.

    Raises:
        DeviceFault: It cannot be opened.
    """
    with vendor_call(f"opening tactile sensor {serial}", "connect"):
        sensor = sdk.Sensor.create(serial)
        sensor.calibrateSensor()
        return sensor


class TactileSensors:
    """Both tactile sensors: pairs of depth maps on request.

    Args:
        sdk: The vendor's module.
        sensors: Left and right, from `open_sensor`.
        clock: Time.
        limits: Shapes of the maps and the images.
        mirror: Pad whose columns run along -x_P.
    """

    def __init__(self, sdk: Any, sensors: tuple[Any, Any], clock: Clock, limits: HandLimits, mirror: str) -> None:
        self._sensors, self._clock = sensors, clock
        self._shape = limits.pad_shape
        self._image_shape = limits.image_shape
        self._types = sdk.Sensor.OutputType.Depth, sdk.Sensor.OutputType.TimeStamp
        self._image_type = sdk.Sensor.OutputType.Rectify
        self._mirrored = mirror == "left", mirror == "right"
        self._lateness = [math.inf, math.inf]
        self._last = [-math.inf, -math.inf]
        self._maps: list[Array | None] = [None, None]
        self._stamps = [-math.inf, -math.inf]
        self._pictures: list[bytes | None] = [None, None]
        self._image_due = False
        self._newest_images: Images | None = None
        self._requested_s = -math.inf
        self._reading = False
        self._newest: Maps | None = None
        self._newest_s = -math.inf
        self._failed: DeviceFault | None = None
        self._closed = False

    def request(self) -> None:
        """Request frames; call once a period while they are needed."""
        now = self._clock.now_s()
        if now - self._requested_s > MAX_UNREQUESTED_S:
            self._newest, self._newest_s = None, now
        self._requested_s = now
        if not self._reading and not self._closed:
            self._reading = True
            self._clock.spawn(self._read_while_requested)

    def request_images(self) -> None:
        """Request one pair of gel images, while frames are requested; without a shape for them, none come."""
        self._image_due = self._image_shape is not None

    def take_images(self) -> Images | None:
        """Return a new pair of gel images once, or None."""
        newest, self._newest_images = self._newest_images, None
        return newest

    def take(self) -> Maps | None:
        """Return a new pair once, or None.

        Raises:
            DeviceFault: A sensor failed, or no pair has come for too long.
        """
        if self._failed is not None:
            raise self._failed
        now = self._clock.now_s()
        if now - self._requested_s <= MAX_UNREQUESTED_S and now - self._newest_s > MAX_MISSING_S:
            raise DeviceFault(
                "stale", "the tactile sensors deliver no frames", age_s=now - self._newest_s, limit_s=MAX_MISSING_S
            )
        newest, self._newest = self._newest, None
        return newest

    def _read_while_requested(self) -> None:
        try:
            while not self._closed and self._clock.now_s() - self._requested_s <= MAX_UNREQUESTED_S:
                for side in (LEFT, RIGHT):
                    self._read(side)
                self._pair()
                self._clock.sleep_until(self._clock.now_s() + POLL_S)
        except DeviceFault as e:
            self._failed = e
        finally:
            self._reading = False

    def _read(self, side: int) -> None:
        """Read one sensor; only one call for both gives depth and stamp of the same frame."""
        with vendor_call(f"reading the {('left', 'right')[side]} tactile sensor", "link"):
            types = (*self._types, self._image_type) if self._image_due else self._types
            depth, stamp, *pictures = self._sensors[side].selectSensorInfo(*types)
            if depth is None or stamp is None:
                return
            taken = float(stamp)
            if taken == self._last[side]:
                return
            self._last[side] = taken
            taken = self._on_our_clock(side, taken)
            self._maps[side] = depth_map_m(depth, self._shape, self._mirrored[side])
            self._pictures[side] = None
            if self._image_shape is not None and pictures and pictures[0] is not None:
                self._pictures[side] = gel_image(pictures[0], self._image_shape, self._mirrored[side]).tobytes()
            self._stamps[side] = taken

    def _on_our_clock(self, side: int, stamp_s: float) -> float:
        now = self._clock.now_s()
        if abs(now - stamp_s) < MAX_SAME_CLOCK_S:
            return stamp_s
        calendar = time.time()  # noqa: TID251  the sensor's clock is compared with, no time is measured
        if abs(calendar - stamp_s) < MAX_SAME_CLOCK_S:
            return now - (calendar - stamp_s)
        self._lateness[side] = min(self._lateness[side], now - stamp_s)
        return stamp_s + self._lateness[side]

    def _pair(self) -> None:
        left, right = self._maps
        if left is None or right is None or abs(self._stamps[LEFT] - self._stamps[RIGHT]) > MAX_PAIR_S:
            return
        stamp = 0.5 * (self._stamps[LEFT] + self._stamps[RIGHT])
        self._maps = [None, None]
        self._newest = Maps(stamp, *self._shape, _bytes(left), _bytes(right))
        left_image, right_image = self._pictures
        if self._image_shape is not None and left_image is not None and right_image is not None:
            self._newest_images = Images(stamp, *self._image_shape, left_image, right_image)
            self._image_due = False
        self._pictures = [None, None]
        self._newest_s = self._clock.now_s()

    def release(self) -> None:
        """Release the sensors, as the vendor's documentation requires; never raises."""
        self._closed = True
        for sensor in self._sensors:
            try:
                sensor.release()
            except Exception:  # the session ends
                continue


def _bytes(array: Array) -> bytes:
    return np.ascontiguousarray(array, dtype="<f8").tobytes()
