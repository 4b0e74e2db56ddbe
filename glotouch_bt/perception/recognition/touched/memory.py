"""Touch data of one object in its frame O, without any mesh.

The first encounter defines O: its origin is the centre of the traced outline, its axes are those of K. Later encounters
are turned and moved into O by the fitted pose. z is the height above the floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.recognition.evidence import read_evidence
from glotouch_bt.perception.recognition.model import PadSpec, hand_axes
from glotouch_bt.perception.recognition.touched.outlines import extents_m, middle_m
from glotouch_bt.perception.touch import Contour, TouchSet, layer_patches
from glotouch_bt.robot import Array, ParamError

Planar = tuple[float, float, float]
"""(x m, y m, yaw rad) of O in K."""


@dataclass(frozen=True, eq=False)
class FeltClosure:
    """One closure of the jaws, in O.

    Attributes:
        phi_rad: Direction of x_P.
        along_m: Coordinate of the pads' mid-point along x_P.
        height_m: Height of the pads' mid-point.
        aperture_m: Aperture on the plateau.
        width_m: Rigid width: aperture plus both indentations; an upper bound if only one pad was in contact.
        images: (left, right) image features (35,); None for a pad without contact.
        areas: (left, right) contact area as a fraction of the pad.
    """

    phi_rad: float
    along_m: float
    height_m: float
    aperture_m: float
    width_m: float
    images: tuple[Array | None, Array | None]
    areas: tuple[float, float]

    @property
    def two_sided(self) -> bool:
        """Both pads were in contact, so that the width is exact."""
        return all(image is not None for image in self.images)


@dataclass(frozen=True, eq=False)
class Encounter:
    """One handling of the object.

    Attributes:
        contour: Its traced outline, in O.
        height_m: Its measured top above the floor.
        closures: Its closures.
    """

    contour: Contour
    height_m: float
    closures: tuple[FeltClosure, ...]


@dataclass(frozen=True, eq=False)
class TouchedObject:
    """Touch data of all encounters with one object.

    Attributes:
        name: Its name.
        encounters: Its handlings, the first one first; at least one.
    """

    name: str
    encounters: tuple[Encounter, ...]

    def __post_init__(self) -> None:
        if not self.encounters or not any(c.two_sided for e in self.encounters for c in e.closures):
            raise ParamError(f"touched object {self.name}", "no closure of both pads", "at least one")

    @property
    def closures(self) -> tuple[FeltClosure, ...]:
        """All closures of all encounters."""
        return tuple(c for e in self.encounters for c in e.closures)

    @property
    def height_m(self) -> float:
        """Median of the measured tops."""
        return float(np.median([e.height_m for e in self.encounters]))

    def grown(self, encounter: Encounter) -> TouchedObject:
        """Return the object after another encounter."""
        return replace(self, encounters=(*self.encounters, encounter))


def encounter_of(touchset: TouchSet, pad: PadSpec, pose_K_O: Planar | None = None) -> Encounter:
    """Return what a TouchSet tells about its object, in O.

    The jaws centre the object. So each sequence tells where the object was then, across the jaws, and the following
    closures are placed relative to that.

    Args:
        touchset: The touches of one object. Its top must have been touched.
        pad: The pad.
        pose_K_O: Pose of O before the closures; default: O is at the outline's centre, turned as K.

    Raises:
        ParamError: The top was not touched, or a depth map is too small.
    """
    candidate = touchset.candidate
    if not candidate.top_touched:
        raise ParamError(f"candidate {candidate.index}", "top not touched", "an object whose top was touched")
    x, y, theta = pose_K_O or (*np.asarray(candidate.contour.centre_K_m, dtype=np.float64).tolist(), 0.0)
    contour = in_frame(candidate.contour, (x, y, theta))
    origin = np.array([x, y])
    closures = []
    for e in read_evidence(touchset, pad).layers:
        layer = touchset.sequences[e.sequence].layers[e.index]
        along_axis, across_axis = hand_axes(np.asarray(layer.yaw_rad))
        place = np.asarray(layer.position_K_m, dtype=np.float64)
        phi, along = math.remainder(layer.yaw_rad - theta, 2 * math.pi), float(along_axis @ (place - origin))
        areas = [float(p.area_fraction) for p in layer_patches(layer)]
        closures.append(
            FeltClosure(
                phi, along, layer.height_m, layer.aperture_m, e.width_m, e.images, (areas[0], areas[1])
            )
        )  # fmt: skip
        middle = middle_m(contour, phi, along, 0.5 * pad.window_m[0])
        if not e.upper_only and math.isfinite(middle):
            origin = origin + across_axis * float(across_axis @ (place - origin) - middle)
    return Encounter(contour, candidate.height_m, tuple(closures))


def beyond_jaws_m(encounter: Encounter, sensing_m: float, pad: PadSpec) -> float:
    """Return how far the outline reaches beyond the closed jaws, at most, m; 0 if nowhere, or if no closure tells.

    Pads that cover the height of the outline cannot come closer than its extent between them. If they did, the object
    moved while it was traced, or was traced wrongly.

    Args:
        encounter: What was felt.
        sensing_m: Height of the outline above the floor.
        pad: The pad.
    """
    half_width_m, half_length_m = 0.5 * pad.window_m[0], 0.5 * pad.window_m[1]
    found = 0.0
    for c in encounter.closures:
        if c.two_sided and abs(c.height_m - sensing_m) <= half_length_m:
            low, high = extents_m(encounter.contour, np.array([c.phi_rad]), np.array([c.along_m]), half_width_m)
            if math.isfinite(extent := float(high[0, 0] - low[0, 0])):
                found = max(found, extent - c.width_m)
    return found


def in_frame(contour: Contour, pose_K_O: Planar) -> Contour:
    """Return an outline of K in O."""
    x, y, theta = pose_K_O
    c, s = math.cos(theta), math.sin(theta)
    to_O = np.array([[c, s], [-s, c]])
    turned = contour.yaw_rad - theta if contour.family != "circle" else 0.0
    return replace(
        contour,
        centre_K_m=to_O @ (np.asarray(contour.centre_K_m) - [x, y]),
        yaw_rad=(turned + 0.5 * math.pi) % math.pi - 0.5 * math.pi,
        boundary_K_m=(contour.boundary_K_m - [x, y]) @ to_O.T,
    )
