"""Read world and conditions files into frozen values. Every fault has its place."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, replace
from os.path import isdir
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, create_model

from glotouch_bt.escaped_text import fault_of_name
from glotouch_bt.mission.read.fields import validate
from glotouch_bt.mission.read.library import find_shipped, shown
from glotouch_bt.mission.read.parameters import fault_of_solid
from glotouch_bt.mission.read.yaml_source import read_yaml
from glotouch_bt.mission.spec import Findings, Map, MissionFaults, Node, Place, Seq
from glotouch_bt.robot import (
    BadInput,
    Conditions,
    Container,
    Holder,
    ObjectSet,
    ParamError,
    Pose,
    Probe,
    UnknownName,
    World,
)
from glotouch_bt.robot.scene import MESH_SUFFIXES, stl_files

T = TypeVar("T")
Vec3 = tuple[float, float, float]
Range = tuple[float, float]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


class PoseSection(_Section):
    """A planar pose: an origin and a rotation about z."""

    position_m: Vec3 = Field(description="origin in B: [x, y, z], m")
    yaw_deg: float = Field(default=0.0, description="rotation about z_B, deg")


class ContainerSection(_Section):
    """The open box; see `robot.Container`."""

    pose_B_K: PoseSection = Field(description="centre of the floor, and the direction of x_K")
    interior_m: Vec3 = Field(description="inside of the box along x_K, y_K and up, m")
    wall_m: float = Field(default=Container.wall_m, description="thickness of the walls, m")


class ProbeSection(_Section):
    """The passive probe; see `robot.Probe`."""

    tip_radius_m: float = Field(default=Probe.tip_radius_m, description="radius of the ball, m")
    shaft_diameter_m: float = Field(default=Probe.shaft_diameter_m, description="thickness of the shaft, m")
    length_m: float = Field(
        default=Probe.length_m, description="from the handle's lower face to the lowest point of the ball, m"
    )
    handle_m: Vec3 = Field(
        default=Probe.handle_m, description="sides of the handle, m; the jaws close along the second"
    )
    mass_kg: float = Field(default=Probe.mass_kg, description="mass, kg")
    com_below_grasp_m: float = Field(
        default=Probe.com_below_grasp_m, description="centre of mass below the handle's centre, m"
    )


class HolderSection(_Section):
    """The place of the stowed probe; the grasp pose points down. See `robot.Holder`."""

    pose_B_grasp: PoseSection = Field(description="centre of the stowed probe's handle")
    half_m: Vec3 = Field(default=Holder.half_m, description="half extents of the holder's block, m")


class ObjectsSection(_Section):
    """The STL files of the objects in the container; see `robot.ObjectSet`."""

    folder: str = Field(description="folder of STL files, relative to the world's file")
    names: tuple[str, ...] = Field(default=(), description="only these files of the folder; empty: all of them")
    expected: int | None = Field(
        default=None, ge=1, le=20, description="required number of objects, in the folder or in names"
    )
    min_gap_m: float = Field(
        default=ObjectSet.min_gap_m,
        ge=0,
        le=1.0,
        description="smallest gap between two objects of a simulated layout, m",
    )
    min_wall_gap_m: float = Field(
        default=ObjectSet.min_wall_gap_m, ge=0, le=1.0, description="smallest gap between an object and a wall, m"
    )
    touching_share: float = Field(
        default=ObjectSet.touching_share,
        ge=0,
        le=1,
        description="share of the objects that touch another one or a wall",
    )
    stance: Literal["upright", "any"] = Field(
        default=ObjectSet.stance, description="upright as in the file, or each object on any of its stable sides"
    )
    lying_share: float | None = Field(
        default=ObjectSet.lying_share, ge=0, le=1,
        description="with stance any: share that lies on another side than upright; none: as each side is probable",
    )  # fmt: skip


class WorldFile(_Section):
    """A world file."""

    world: str = Field(description="its name")
    description: str = ""
    container: ContainerSection
    probe: ProbeSection = ProbeSection()
    holder: HolderSection
    objects: ObjectsSection


ConditionsFile = create_model(  # type: ignore[call-overload]
    "ConditionsFile",
    __base__=_Section,
    **{f.name: ((str, ...) if f.name == "name" else (float | Range, f.default)) for f in fields(Conditions)},
)


def read_world(node: Node, file: Path, findings: Findings, objects: Path | None = None) -> World | None:
    """Return a world from its source; None if that gave findings.

    Args:
        node: The file's content, or a mission's inline world.
        file: The file; `objects.folder` is relative to it.
        findings: Where faults go.
        objects: A folder to use instead of the file's (then every STL in it).
    """
    if not isinstance(node, Map):
        findings.add(node.place, "wrong_type", "a world must be a mapping", valid=", ".join(WorldFile.model_fields))
        return None
    given = validate(WorldFile, node, "the world", findings)
    if given is None:
        return None

    if fault := fault_of_name(given.world):
        findings.add((node.get("world") or node).place, "wrong_name", f"world: {fault}")
        return None

    def made(section: str, make: Callable[[], T]) -> T | None:
        try:
            return make()
        except ParamError as e:
            findings.add(_section_place(node, section, e.name), "wrong_value", str(e))
            return None

    c, h = given.container, given.holder
    container = made(
        "container",
        lambda: Container(
            pose_B_K=Pose.planar(c.pose_B_K.position_m, math.radians(c.pose_B_K.yaw_deg)),
            interior_m=c.interior_m,
            wall_m=c.wall_m,
        ),
    )
    probe = made("probe", lambda: Probe(**given.probe.model_dump()))
    holder = made(
        "holder",
        lambda: Holder(
            pose_B_grasp=Pose.pointing_down(h.pose_B_grasp.position_m, math.radians(h.pose_B_grasp.yaw_deg)),
            half_m=h.half_m,
        ),
    )
    section = node.get("objects")
    chosen = _objects(given.objects, section if isinstance(section, Map) else node, file, findings, objects)
    if container is None or probe is None or holder is None or chosen is None:
        return None
    return World(name=given.world, container=container, probe=probe, holder=holder, objects=chosen)


def _objects(
    given: ObjectsSection, node: Map, file: Path, findings: Findings, override: Path | None
) -> ObjectSet | None:
    placed: dict[str, Any] = given.model_dump(
        include={"min_gap_m", "min_wall_gap_m", "touching_share", "stance", "lying_share"}
    )
    if override is not None:
        given_at = Place(f"--objects {override}")
        files = _files(override, given_at, f"is not a folder with .stl files in it{_others(override)}", findings)
        if not files:
            return None
        _check_solids(files.values(), given_at, findings)
        return ObjectSet(folder=override, **placed)
    folder = (file.parent / given.folder).resolve()
    at = node.get("folder") or node
    what = f"objects.folder {given.folder!r} ({folder}) is not a folder with .stl files{_others(folder)}"
    stems = _files(folder, at.place, what, findings)
    if not stems:
        return None
    before = len(findings)
    written = node.get("names")
    for i, name in enumerate(given.names):
        place = written.items[i].place if isinstance(written, Seq) else at.place
        if name not in stems:
            findings.unknown(place, "no_such_stl", "object", name, stems)
        elif name in given.names[:i]:
            findings.add(place, "wrong_value", f"objects.names: {name!r} is listed twice")
    count = len(given.names or stems)
    if given.expected is not None and count != given.expected:
        expected = node.get("expected") or node
        findings.add(expected.place, "wrong_value", f"objects.expected = {given.expected}, but {count} are chosen")
    if len(findings) > before:
        return None
    _check_solids([stems[name] for name in given.names or stems], at.place, findings)
    return ObjectSet(folder=folder, names=given.names, **placed)


def _check_solids(files: Iterable[Path], at: Place, findings: Findings) -> None:
    """Report every file that is not a valid solid, because a simulator refuses them all, not only the target."""
    for fault in filter(None, map(fault_of_solid, files)):
        findings.add(at, "unusable_stl", fault)


def _others(folder: Path) -> str:
    """Return what to do with a folder that has meshes of other formats, or empty."""
    convertible = isdir(folder) and any(p.suffix.lower() in MESH_SUFFIXES for p in folder.iterdir())
    return f" (`glotouch objects {folder} --out DIR` converts its meshes of other formats)" if convertible else ""


def _files(folder: Path, at: Place, missing: str, findings: Findings) -> dict[str, Path]:
    """Return the files of a folder by object; none if that gave a finding (`missing`: what it says)."""
    try:
        files = stl_files(folder) if isdir(folder) else {}
    except BadInput as e:
        findings.add(at, "unusable_stl", str(e))
        return {}
    if not files:
        findings.add(at, "no_objects", missing)
    return files


def _section_place(node: Map, section: str, dotted: str) -> Place:
    below = node.get(section)
    last = dotted.rsplit(".", 1)[-1]
    if isinstance(below, Map):
        value = below.get(last)
        return value.place if value is not None else below.place
    return node.place


def load_world(given: str) -> World:
    """Load a world by path or shipped name.

    Raises:
        BadInput: It is unknown, unreadable or faulty (all faults at once).
    """
    path = find_shipped("worlds", given, "world")
    findings = Findings()
    world = read_world(read_yaml(path, shown(path)), path, findings)
    if world is None:
        raise MissionFaults(findings.sorted())
    return world


def split_conditions(given: str) -> tuple[str, list[str]]:
    """Return the profile (a path or shipped name) and the changes of `PROFILE+FIELD=VALUE+FIELD=VALUE`."""
    profile, *changes = re.split(r"\+(?=\w+=)", given)
    return profile, changes


def conditions_name(given: str) -> str:
    """Return the profile's name with its changes, without a path."""
    profile, changes = split_conditions(given)
    return "+".join([Path(profile).stem, *changes])


def load_conditions(given: str) -> Conditions:
    """Load a disturbance profile by path or shipped name; keys are the field names of `robot.Conditions`.

    `PROFILE+FIELD=VALUE` changes a field of the profile. VALUE is a number, or LOW,HIGH for a range.

    Raises:
        BadInput: It is unknown, unreadable or faulty (all faults at once), or a change names no field.
    """
    profile, changes = split_conditions(given)
    path = find_shipped("conditions", profile, "conditions")
    findings = Findings()
    node = read_yaml(path, shown(path))
    if isinstance(node, Map):
        made = validate(ConditionsFile, node, "conditions", findings)
        if made is not None:
            try:
                read = Conditions(**made.model_dump())
            except (ParamError, TypeError) as e:
                at = node.get(getattr(e, "name", "").rsplit(".", 1)[-1]) or node
                findings.add(at.place, "wrong_value", str(e))
            else:
                return _changed(read, changes) if changes else read
    else:
        findings.add(node.place, "wrong_type", "conditions must be a mapping of field: value")
    raise MissionFaults(findings.sorted())


def _changed(read: Conditions, changes: list[str]) -> Conditions:
    valid = [f.name for f in fields(read) if f.name != "name"]
    values: dict[str, float | tuple[float, ...]] = {}
    for change in changes:
        name, _, text = change.partition("=")
        if name not in valid:
            raise UnknownName("field of conditions", name, valid)
        if name in values:
            raise BadInput(f"conditions.{name}: given twice")
        try:
            numbers = tuple(float(word) for word in text.strip("[] ").split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in (1, 2):
            raise ParamError(f"conditions.{name}", text, "a number, or LOW,HIGH")
        values[name] = numbers[0] if len(numbers) == 1 else numbers
    return replace(read, name="+".join([read.name, *changes]), **values)  # type: ignore[arg-type]


def conditions_of(values: Mapping[str, object], shown: str) -> Conditions:
    """Return the conditions that a run stored, as `dataclasses.asdict` gave them.

    Raises:
        BadInput: They are damaged.
    """
    try:
        return Conditions(**ConditionsFile(**values).model_dump())
    except (ValueError, TypeError) as e:  # also ValidationError
        raise BadInput(f"{shown}: cannot be used ({e})") from e
