"""Objects known only by touch, as files: `touched/<name>.json` in the current folder, beside `runs`.

Such a file is untrusted input. It is read into a schema with bounds before anything is computed from it.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from glotouch_bt.perception.recognition.touched import Encounter, FeltClosure, TouchedObject
from glotouch_bt.perception.touch import Contour, minimum_rectangle
from glotouch_bt.robot import BadInput, ParamError
from glotouch_bt.untrusted import parse_json, read_file, write_file

PREFIX = "touched:"
"""A target that begins so is an object known only by touch."""
FOLDER = Path("touched")
"""Folder of the files, relative to the current one."""
MAX_FILE_BYTES = 4_000_000
"""Largest file that is read. Source: ours; an encounter of 20 closures takes 30 kB."""
MAX_ENCOUNTERS = 10
"""Largest number of encounters; of more, the oldest are forgotten. Source: ours; 200 closures are fitted in 1 s."""
TOUCHED_NAME_PATTERN = r"^[A-Za-z0-9_-]{1,64}$"
"""Names of touched objects, as a regular expression."""

Length = Annotated[float, Field(ge=-0.5, le=0.5)]
Size = Annotated[float, Field(gt=0.0, le=0.5)]
Angle = Annotated[float, Field(ge=-4.0 * math.pi, le=4.0 * math.pi)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Image = Annotated[list[Annotated[float, Field(ge=0.0, le=5.0)]], Field(min_length=35, max_length=35)]
Variance = Annotated[float, Field(ge=-1.0, le=10.0)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class _Closure(_Part):
    phi_rad: Angle
    along_m: Length
    height_m: Size
    aperture_m: Length
    width_m: Length
    left: Image | None
    right: Image | None
    left_area: Share
    right_area: Share


class _Outline(_Part):
    kind: Literal["round", "box"]
    family: Literal["circle", "rectangle", "free"]
    centre_m: Annotated[list[Length], Field(min_length=2, max_length=2)]
    size_m: Annotated[list[Size], Field(min_length=2, max_length=2)]
    yaw_rad: Angle
    rms_m: Annotated[float, Field(ge=0.0, le=0.5)]
    covariance: Annotated[list[Annotated[list[Variance], Field(max_length=5)]], Field(max_length=5)]
    boundary_m: Annotated[
        list[Annotated[list[Length], Field(min_length=2, max_length=2)]], Field(max_length=1000)
    ]  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if any(len(row) != len(self.covariance) for row in self.covariance):
            raise ValueError("covariance: must be square")
        if self.family == "free":
            minimum_rectangle(np.array(self.boundary_m).reshape(-1, 2))
        elif self.boundary_m or (self.family == "circle") != (self.kind == "round"):
            raise ValueError(f"family {self.family}: does not go with kind {self.kind} and this boundary")
        return self


class _Encounter(_Part):
    outline: _Outline
    height_m: Size
    closures: Annotated[list[_Closure], Field(min_length=1, max_length=100)]


class _File(_Part):
    format: Literal["glotouch touched object"]
    version: Literal[1]
    name: str
    encounters: Annotated[list[_Encounter], Field(min_length=1, max_length=MAX_ENCOUNTERS)]


def touched_name(target: str) -> str:
    """Return the name of a touched object that a target names, or empty if the target is an STL."""
    return target[len(PREFIX) :] if target.startswith(PREFIX) else ""


def touched_path(name: str) -> Path:
    """Return the file of a touched object.

    Raises:
        BadInput: The name cannot be that of a file.
    """
    if not re.fullmatch(TOUCHED_NAME_PATTERN, name):
        raise BadInput(f"{name!r} cannot name a touched object: use 1 to 64 letters, digits, _ and -")
    return FOLDER / f"{name}.json"


def touched_names() -> list[str]:
    """Return the names of the objects that were remembered."""
    return sorted(p.stem for p in FOLDER.glob("*.json") if re.fullmatch(TOUCHED_NAME_PATTERN, p.stem))


def read_touched(name: str) -> TouchedObject:
    """Read a touched object.

    Raises:
        BadInput: There is none of that name, or its file is not valid. The message says what to do.
    """
    path = touched_path(name)
    if not path.exists():
        known = ", ".join(touched_names()) or "nothing yet"
        raise BadInput(
            f"{path}: no such file, so nothing of {name!r} was felt (remembered: {known}); put it alone into the box "
            f"and run `glotouch run remember --set name={name}`"
        )
    try:
        file = _File.model_validate(parse_json(read_file(path, MAX_FILE_BYTES), str(path)))
        return TouchedObject(name, tuple(_encounter(e) for e in file.encounters))
    except (ValidationError, ParamError) as e:
        why = str(e)
        if isinstance(e, ValidationError):
            why = f"{'.'.join(map(str, e.errors()[0]['loc']))}: {e.errors()[0]['msg']}"
        raise BadInput(f"{path}: is not a touched object of this release ({why}); remember the object again") from e


def write_touched(felt: TouchedObject) -> Path:
    """Write a touched object atomically, and return its file. The newest `MAX_ENCOUNTERS` encounters are kept.

    Raises:
        BadInput: The file cannot be written.
    """
    path = touched_path(felt.name)
    file = _File(
        format="glotouch touched object",
        version=1,
        name=felt.name,
        encounters=[_encounter_part(e) for e in felt.encounters[-MAX_ENCOUNTERS:]],
    )
    try:
        path.parent.mkdir(exist_ok=True)
        write_file(path, file.model_dump_json(indent=1).encode(), durable=True)
    except OSError as e:
        raise BadInput(f"{path}: cannot be written ({e.strerror})") from e
    return path


def _encounter(e: _Encounter) -> Encounter:
    o = e.outline
    contour = Contour(
        o.kind, np.array(o.centre_m), (o.size_m[0], o.size_m[1]), o.yaw_rad, o.rms_m, np.zeros(0), o.family,
        np.array(o.covariance).reshape(len(o.covariance), -1), np.array(o.boundary_m).reshape(-1, 2),
    )  # fmt: skip
    return Encounter(contour, e.height_m, tuple(_closure(c) for c in e.closures))


def _closure(c: _Closure) -> FeltClosure:
    left, right = (None if image is None else np.array(image) for image in (c.left, c.right))
    return FeltClosure(
        c.phi_rad, c.along_m, c.height_m, c.aperture_m, c.width_m, (left, right), (c.left_area, c.right_area)
    )  # fmt: skip


def _encounter_part(e: Encounter) -> _Encounter:
    c = e.contour
    outline = _Outline(
        kind=c.kind, family=c.family or "circle", centre_m=_floats(c.centre_K_m), size_m=_floats(c.size_m),
        yaw_rad=float(c.yaw_rad), rms_m=float(c.rms_m),
        covariance=[_floats(row) for row in c.covariance], boundary_m=[_floats(p) for p in c.boundary_K_m],
    )  # fmt: skip
    closures = [
        _Closure(
            phi_rad=float(x.phi_rad), along_m=float(x.along_m), height_m=float(x.height_m),
            aperture_m=float(x.aperture_m), width_m=float(x.width_m),
            left=None if x.images[0] is None else _floats(x.images[0]),
            right=None if x.images[1] is None else _floats(x.images[1]),
            left_area=float(x.areas[0]), right_area=float(x.areas[1]),
        )
        for x in e.closures
    ]  # fmt: skip
    return _Encounter(outline=outline, height_m=float(e.height_m), closures=closures)


def _floats(values: object) -> list[float]:
    return [float(v) for v in np.asarray(values, dtype=np.float64)]
