"""Make one file an object: read, repair, stand upright, judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from glotouch_bt.errors import BadInput
from glotouch_bt.objects.files import ImplausibleSize, RawMesh, read_mesh
from glotouch_bt.objects.jaws import JawFit, jaw_fit
from glotouch_bt.objects.picture import SMALL_PIXELS, picture
from glotouch_bt.objects.repair import repaired
from glotouch_bt.objects.sides import Side, choose_side, sides_of
from glotouch_bt.perception import TooLow, model_for, too_wide
from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.robot import Gripper
from glotouch_bt.robot.scene import Mesh, solid_of, turned

DENSITY_KG_M3 = 1240.0
"""Density of solid PLA, the usual plastic of printed objects. Source: data sheets of filaments."""

MAX_SHOWN = 8
"""Number of sides to show. Source: ours; a box has six."""


@dataclass(frozen=True)
class Prepared:
    """An object that can be put into the box.

    Attributes:
        name: Its name: the stem of its file.
        source: Its file.
        mesh: The solid as it will be loaded from the clean file.
        stl: Content of the clean file: a binary STL in metres, upright.
        notes: What was converted and repaired.
        sides: Sides on which the repaired mesh stands, the most probable first.
        side: Index of the side on which it stands, or None.
        volume_m3: Its volume.
        model: Its tactile model; None if it cannot be felt or no gripper is known.
        fit: The jaws against it; None as above.
        faults: Why it cannot be a target, or can hardly be one.
        png: Its picture; empty if none can be drawn here.
        side_pngs: Small pictures of the first `MAX_SHOWN` sides.
    """

    name: str
    source: Path
    mesh: Mesh
    stl: bytes
    notes: tuple[str, ...]
    sides: tuple[Side, ...]
    side: int | None
    volume_m3: float
    model: TargetModel | None
    fit: JawFit | None
    faults: tuple[str, ...]
    png: bytes
    side_pngs: tuple[bytes, ...]

    @property
    def mass_kg(self) -> float:
        """Mass in solid PLA."""
        return self.volume_m3 * DENSITY_KG_M3

    def as_dict(self) -> dict[str, Any]:
        """Return plain data, for --json."""
        return {
            "name": self.name,
            "source": str(self.source),
            "usable": True,
            "size_m": [round(float(s), 6) for s in self.mesh.extents_m],
            "volume_m3": self.volume_m3,
            "mass_solid_pla_kg": self.mass_kg,
            "triangles": len(self.mesh.faces),
            "notes": list(self.notes),
            "sides": [{"share": s.share, "tilt_deg": s.tilt_deg} for s in self.sides],
            "side": None if self.side is None else self.side + 1,
            "jaws": None if self.fit is None else self.fit.in_words(),
            "faults": list(self.faults),
        }


@dataclass(frozen=True)
class RefusedFile:
    """A file that is no object.

    Attributes:
        name, source: As in `Prepared`.
        reason: Why, and what to do.
        unit: The unit in which the file has a plausible size, if its size is the reason; or empty.
    """

    name: str
    source: Path
    reason: str
    unit: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return plain data, for --json."""
        return {
            "name": self.name,
            "source": str(self.source),
            "usable": False,
            "reason": self.reason,
            "unit": self.unit,
        }


def prepare(
    path: Path, unit: str | None = None, side: int | None = None, gripper: Gripper | None = None
) -> Prepared | RefusedFile:
    """Make one file an object, or say why it cannot be one.

    Args:
        path: The file.
        unit: Unit of its numbers, a key of `UNITS_M`; None: metres.
        side: Number of the side on which to stand it, from 1; None: see `choose_side`.
        gripper: The jaws and pads; None: they are not judged.
    """
    try:
        return _prepared(path, unit, side, gripper)
    except BadInput as e:
        fitting = e.fitting[0] if isinstance(e, ImplausibleSize) and e.fitting else ""
        return RefusedFile(path.stem, path, str(e).removeprefix(f"{path}: "), fitting)


def _prepared(path: Path, unit: str | None, number: int | None, gripper: Gripper | None) -> Prepared:
    raw = read_mesh(path, unit)
    mesh_in_file, repairs = _solid(path, raw)
    sides = sides_of(mesh_in_file)
    chosen, note = choose_side(sides, number)
    mesh = mesh_in_file if chosen is None else turned(mesh_in_file, sides[chosen].quat)
    low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    stl = _stl(mesh.vertices_m - [*(0.5 * (low + high))[:2], low[2]], mesh.faces)
    mesh = solid_of(path, stl)
    faults: list[str] = []
    model, fit = _judged(mesh, gripper, faults)
    volume = float(mesh.as_trimesh().volume)
    notes = tuple(n for n in (*raw.notes, *repairs, note) if n)
    try:
        png = picture(mesh)
        shown = tuple(picture(turned(mesh_in_file, s.quat), SMALL_PIXELS) for s in sides[:MAX_SHOWN])
    except Exception as e:  # each platform of the ray tracer fails in its own way
        png, shown, notes = b"", (), (*notes, f"no picture can be drawn here ({type(e).__name__})")
    return Prepared(path.stem, path, mesh, stl, notes, sides, chosen, volume, model, fit, tuple(faults), png, shown)


def _solid(path: Path, raw: RawMesh) -> tuple[Mesh, tuple[str, ...]]:
    """Return the solid that a run would load from these triangles, repaired only if it would refuse them."""
    try:
        return solid_of(path, _stl(raw.vertices_m, raw.faces)), ()
    except BadInput:
        vertices, faces, repairs = repaired(raw.vertices_m, raw.faces)
        return solid_of(path, _stl(vertices, faces)), repairs


def _judged(mesh: Mesh, gripper: Gripper | None, faults: list[str]) -> tuple[TargetModel | None, JawFit | None]:
    """Return the tactile model and the jaws' fit; append why the object cannot be a target."""
    if gripper is None:
        return None, None
    try:
        model = model_for(mesh, gripper)
    except TooLow as e:
        faults.append(str(e))
        return None, None
    fit = jaw_fit(model, gripper)
    if fault := too_wide(model, gripper):
        faults.append(fault)
    elif not fit.fits.any():
        faults.append(f"the jaws cannot be lowered over it: {fit.in_words()}")
    if model.height_m > fit.palm_m:
        faults.append(
            f"is {model.height_m * 1e3:.0f} mm high: above {fit.palm_m * 1e3:.0f} mm the hand's body meets it "
            "before the fingers reach its lower part"
        )
    return model, fit


def _stl(vertices_m: np.ndarray[tuple[int, int], np.dtype[np.float64]], faces: object) -> bytes:
    return bytes(trimesh.Trimesh(vertices_m, faces, process=False).export(file_type="stl"))


def chosen_sides(given: Mapping[str, str], names: Mapping[str, Path]) -> dict[str, int]:
    """Return the sides that the user chose by object.

    Raises:
        BadInput: There is no such object, or a side is no number.
    """
    sides: dict[str, int] = {}
    for name, text in given.items():
        if name not in names:
            raise BadInput(f"--side {name}={text}: no such object (it has {', '.join(names)})")
        if not text.strip().isdecimal():
            raise BadInput(f"--side {name}={text}: must be the number of a side, from 1")
        sides[name] = int(text)
    return sides
