"""Find before a run what would end it: a box out of reach, objects that do not fit into it, an impossible target."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.read import needed_by, shipped_root
from glotouch_bt.mission.spec import Finding, Findings, Place
from glotouch_bt.motion import out_of_reach
from glotouch_bt.perception import TooLow, model_for, too_wide, touched_name
from glotouch_bt.robot import BadInput, Gripper, ObjectSet, RobotDescription, load_backend
from glotouch_bt.robot.scene import Mesh, draw_layout, load_folder, load_mesh

SEED = 0
"""Seed of the layout that is tried: the default of a run. Objects that fit tightly may fail with another one."""


def check_feasible(mission: Mission, backend: str, options: Mapping[str, object]) -> tuple[Finding, ...]:
    """Check reach, place the objects once, and judge the targets; each fault in the words of the run that would fail.

    The shipped objects are not judged again, so that checking a shipped mission stays quick.

    Args:
        mission: The mission.
        backend: Name of a registered backend.
        options: Its options, as `Backend.open` takes them.

    Raises:
        BadInput: There is no such backend, or its robot cannot be read.
        BackendError: It cannot be used here.
    """
    objects, findings = mission.world.objects, Findings()
    description = load_backend(backend).describe(options)
    gripper = None if description is None else description.gripper
    if description is not None:
        for fault in out_of_reach(description, mission.world):
            findings.add(Place(f"world {mission.world.name}"), "box_out_of_reach", f"{description.name}: {fault}")
        for place, fault in missing_parts(mission, description):
            findings.add(place, "missing_part", fault)
    if objects.folder.resolve() == (shipped_root() / "objects").resolve():
        return tuple(findings.sorted())
    meshes = load_folder(objects.folder, objects.names)
    try:
        draw_layout(meshes, mission.world, SEED)
    except BadInput as e:
        findings.add(Place(str(objects.folder)), "no_layout", str(e))
    for name in mission.stl_parameters:
        target = str(mission.parameters.get(name, ""))
        if (
            target
            and not touched_name(target)
            and gripper is not None
            and (fault := ungraspable(_loaded(target, objects), gripper))
        ):
            findings.add(Place(f"--set {name}"), "target_out_of_reach", fault)
    return tuple(findings.sorted())


def missing_parts(mission: Mission, description: RobotDescription) -> list[tuple[Place, str]]:
    """Return where a mission asks for an optional part of the gripper that the robot does not have, and which."""
    found = []
    for node in mission.spec.walk():
        if node.params is None:
            continue
        for name, field in type(node.params).model_fields.items():
            part = needed_by(field)
            if part and getattr(node.params, name) and getattr(description.gripper, part) is None:
                found.append((node.place, f"{name}: the gripper of {description.name} has no {part}"))
    return found


def _loaded(target: str, objects: ObjectSet) -> Mesh:
    if target.lower().endswith(".stl"):
        return load_mesh(Path(target))
    return load_folder(objects.folder, (target,))[0]


def ungraspable(mesh: Mesh, gripper: Gripper) -> str:
    """Return why an object cannot be felt or grasped, or empty."""
    try:
        return too_wide(model_for(mesh, gripper), gripper)
    except TooLow as e:
        return str(e)
