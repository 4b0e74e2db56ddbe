"""Find before a run what would end it: objects that do not fit into the container, a target that cannot be grasped."""

from __future__ import annotations

from pathlib import Path

from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.read import shipped_root
from glotouch_bt.mission.spec import Finding, Findings, Place
from glotouch_bt.perception import TooLow, model_for, too_wide
from glotouch_bt.robot import BadInput, Gripper, ObjectSet, load_backend
from glotouch_bt.robot.scene import Mesh, draw_layout, load_folder, load_mesh

SEED = 0
"""Seed of the layout that is tried: the default of a run. Objects that fit tightly may fail with another one."""


def check_objects(mission: Mission, backend: str) -> tuple[Finding, ...]:
    """Place the objects of a mission once, and judge its targets; each fault in the words of the run that would fail.

    The shipped objects are not judged again, so that checking a shipped mission stays quick.

    Raises:
        BadInput: There is no such backend.
        BackendError: It cannot be used here.
    """
    objects, findings = mission.world.objects, Findings()
    description = load_backend(backend).description
    gripper = None if description is None else description.gripper
    if objects.folder.resolve() == (shipped_root() / "objects").resolve():
        return ()
    meshes = load_folder(objects.folder, objects.names)
    try:
        draw_layout(meshes, mission.world, SEED)
    except BadInput as e:
        findings.add(Place(str(objects.folder)), "no_layout", str(e))
    for name in mission.stl_parameters:
        target = str(mission.parameters.get(name, ""))
        if target and gripper is not None and (fault := out_of_reach(_loaded(target, objects), gripper)):
            findings.add(Place(f"--set {name}"), "target_out_of_reach", fault)
    return tuple(findings.sorted())


def _loaded(target: str, objects: ObjectSet) -> Mesh:
    if target.lower().endswith(".stl"):
        return load_mesh(Path(target))
    return load_folder(objects.folder, (target,))[0]


def out_of_reach(mesh: Mesh, gripper: Gripper) -> str:
    """Return why an object cannot be felt or grasped, or empty."""
    try:
        return too_wide(model_for(mesh, gripper), gripper)
    except TooLow as e:
        return str(e)
