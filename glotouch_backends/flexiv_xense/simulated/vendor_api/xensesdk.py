"""Stand-in for the vendor's `xensesdk`: Depth (700, 400) in mm, positive indented, and Rectify (700, 400, 3), BGR.

A sensor sees its gel from behind, with rows towards the fingertip. So the columns of the LEFT pad run along +x_P and
those of the RIGHT pad along -x_P (ASSUMED: both sensors are mounted alike). Only Depth, Rectify and TimeStamp are
simulated; every other output is None, as an unavailable one is with the real sensor. An image is rendered only after it
was asked for; until then it is None.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from glotouch_backends.flexiv_xense.driver import Clock
from glotouch_backends.flexiv_xense.simulated.hand import SimulatedHand
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import EPOCH_S

Floats = npt.NDArray[np.floating[Any]]
SHAPE = (700, 400)
MM = 1e-3
CREATE_S = 0.5
"""Duration of opening a sensor. ASSUMED."""
CALIBRATE_S = 0.2
"""Duration of calibrating a sensor. ASSUMED."""
PRESSED_MM = 0.2
"""Smallest depth that calibration subtracts: noise and offsets stay, as with the real sensor. ASSUMED."""


class PadLink:
    """One pad on the simulated bus.

    Args:
        hand: The hand.
        clock: What blocking calls wait on.
        right: The pad at -y_P.
        camera: Number of its camera.
    """

    def __init__(self, hand: SimulatedHand, clock: Clock, *, right: bool, camera: int) -> None:
        self.hand, self.clock, self.right, self.camera = hand, clock, right, camera
        self.missing = self.frozen = False


class Sensor:
    """A visuotactile sensor; created by `create`."""

    class OutputType(Enum):
        """Outputs of a sensor."""

        Rectify = 1
        Difference = 2
        Depth = 3
        Marker2D = 4
        Marker3D = 5
        Marker3DFlow = 6
        Marker3DInit = 7
        MarkerUnorder = 8
        Force = 9
        ForceNorm = 10
        Mesh3D = 11
        Mesh3DFlow = 12
        Mesh3DInit = 13
        Marker2DInit = 14
        Marker2DFlip = 15
        ForceResultant = 16
        TimeStamp = 17
        AugDifference = 18
        FineDepth = 21
        Force6DTuned = 22
        CaptureTimeStamp = 23
        Raw = 1000
        Mesh3DNorm = 101
        Flow = 103
        ImgFloat = 104
        ImgMarkerFree = 105
        ImgMarkerEnhance = 106
        ImgObjEnhance = 107
        CoarseDepth = 109

    _links: ClassVar[dict[str, PadLink]] = {}

    def __init__(self, ctx: object = None, engine: object = None) -> None:
        self._link: PadLink | None = None
        self._zero: Floats = np.zeros(SHAPE)
        self._depth: tuple[float, Floats] | None = None

    @classmethod
    def create(
        cls,
        cam_id: int | str | None = None,
        config_path: str | Path | None = None,
        *,
        mac_addr: str | None = None,
        infer_mode: str | None = None,
        rectify_size: Sequence[int] | None = None,
        raw_size: Sequence[int] | None = None,
        disable_infer: bool | None = None,
        seeds: Mapping[str, object] | None = None,
        overrides: Mapping[str, object] | None = None,
        check_serial: bool = True,
        hook_modules: str | Sequence[str] | None = None,
        disable_cache: bool | None = None,
    ) -> Sensor:
        """Open a sensor by serial number or camera number."""
        for serial, link in cls._links.items():
            if cam_id in (serial, link.camera):
                link.clock.sleep_until(link.clock.now_s() + CREATE_S)
                sensor = cls()
                sensor._link = link
                return sensor
        raise ValueError(f"no sensor {cam_id!r}")

    def calibrateSensor(self) -> None:
        """Set the present depth as zero: nothing may touch the pad."""
        if self._link is not None:
            link = self._link
            self._read(link)
            link.clock.sleep_until(link.clock.now_s() + CALIBRATE_S)
            found = self._read(link)
            if found is not None:
                depth = np.nan_to_num(found[1]) + self._zero
                self._zero = depth if float(depth.max()) > PRESSED_MM else np.zeros(SHAPE)

    def selectSensorInfo(self, *output_types: Any) -> Any:
        """Return the output for one type, or a tuple for several, of the same frame; None for what is not available."""
        link = self._link
        found = None if link is None else self._read(link)
        values: list[Any] = []
        for kind in output_types:
            known = self.OutputType[kind] if isinstance(kind, str) else kind
            if link is None or found is None:
                values.append(None)
            elif known is self.OutputType.Depth:
                values.append(found[1])
            elif known is self.OutputType.TimeStamp:
                values.append(EPOCH_S + found[0])
            else:
                values.append(_rectified(link, found[0]) if known is self.OutputType.Rectify else None)
        return values[0] if len(values) == 1 else tuple(values)

    def _read(self, link: PadLink) -> tuple[float, Floats] | None:
        """Return stamp and depth (700, 400) mm of the newest frame."""
        if link.missing:
            return None
        if not link.frozen:
            link.hand.want_frames()
            frame = link.hand.frame
            if frame is not None and (self._depth is None or frame.stamp_s != self._depth[0]):
                depth_m = frame.right_m[:, ::-1] if link.right else frame.left_m
                times = SHAPE[0] // depth_m.shape[0], SHAPE[1] // depth_m.shape[1]
                fine = np.repeat(np.repeat((depth_m / MM).astype(np.float32), times[0], axis=0), times[1], axis=1)
                self._depth = frame.stamp_s, fine - self._zero if self._zero.any() else fine
        return self._depth

    def release(self) -> None:
        """Close the sensor."""
        self._link = None


def _rectified(link: PadLink, stamp_s: float) -> npt.NDArray[np.uint8] | None:
    """Return the image (700, 400, 3) of the frame with this stamp; if it was not rendered, have the next one rendered.

    None for a hand without cameras.
    """
    images = link.hand.images
    if images is None or images.stamp_s != stamp_s:
        link.hand.want_images()
        return None
    image = images.right[:, ::-1] if link.right else images.left
    times = SHAPE[0] // image.shape[0], SHAPE[1] // image.shape[1]
    return np.ascontiguousarray(np.repeat(np.repeat(image, times[0], axis=0), times[1], axis=1)[:, :, ::-1])
