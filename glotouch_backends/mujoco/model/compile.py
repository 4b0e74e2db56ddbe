"""The compiled model of the whole world, and the indices of its parts in MuJoCo's arrays."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.model.arm import add_arm
from glotouch_backends.mujoco.model.contact import GROUP_VISUAL, set_options, set_softness
from glotouch_backends.mujoco.model.container import add_container
from glotouch_backends.mujoco.model.gripper import add_gripper
from glotouch_backends.mujoco.model.objects import add_object
from glotouch_backends.mujoco.model.probe import add_probe
from glotouch_backends.mujoco.truth import Truth
from glotouch_bt.robot import BackendError, Conditions, RobotDescription, World

STEP_S = 0.001
"""Solver step."""
STEPS = 10
"""Solver steps in a control period."""


@dataclass(frozen=True)
class SensorMap:
    """Columns of one row of sensordata."""

    q: slice
    dq: slice
    position: slice
    quat: slice
    force: slice
    torque: slice
    jaws: slice
    jaw_speeds: slice
    jaw_forces: slice


@dataclass(frozen=True)
class Handles:
    """Indices into MuJoCo's arrays, found once after compilation.

    Attributes:
        arm_qpos, arm_dof, arm_ctrl: Slices of the arm in qpos, qvel and ctrl.
        jaw_qpos, jaw_ctrl: Slices of the two jaws in qpos and ctrl.
        hand_bodies: Slice of the bodies hand, finger_left, finger_right.
        held_bodies: The same and the probe, of one body, or of two if its shaft is compliant.
        probe_body, tip_body, tip_site, pads_site, sensor_site, container_body: Ids.
        object_bodies: (n,) body of each object.
        pad_geoms: (left, right).
        sensors: Columns of sensordata.
    """

    arm_qpos: slice
    arm_dof: slice
    arm_ctrl: slice
    jaw_qpos: slice
    jaw_ctrl: slice
    hand_bodies: slice
    held_bodies: slice
    probe_body: int
    tip_body: int
    tip_site: int
    pads_site: int
    sensor_site: int
    object_bodies: tuple[int, ...]
    container_body: int
    pad_geoms: tuple[int, int]
    sensors: SensorMap


@dataclass(frozen=True)
class BuiltWorld:
    """The simulated world of one trial, and what it was built from."""

    description: RobotDescription
    world: World
    conditions: Conditions
    seed: int
    truth: Truth
    model: mujoco.MjModel
    data: mujoco.MjData
    handles: Handles
    proof: AxisProof


def _add_sensors(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Add the sensors that are sampled every millisecond, in the order of `SensorMap`."""
    kind, obj = mujoco.mjtSensor, mujoco.mjtObj

    def add(sensor: mujoco.mjtSensor, what: mujoco.mjtObj, name: str) -> None:
        spec.add_sensor(name=f"{sensor.name}_{name}", type=sensor, objtype=what, objname=name)

    arm = [j.name for j in description.joints]
    jaws = ["jaw_left", "jaw_right"]
    for name in arm:
        add(kind.mjSENS_JOINTPOS, obj.mjOBJ_JOINT, name)
    for name in arm:
        add(kind.mjSENS_JOINTVEL, obj.mjOBJ_JOINT, name)
    add(kind.mjSENS_FRAMEPOS, obj.mjOBJ_SITE, "P")
    add(kind.mjSENS_FRAMEQUAT, obj.mjOBJ_SITE, "P")
    add(kind.mjSENS_FORCE, obj.mjOBJ_SITE, "S")
    add(kind.mjSENS_TORQUE, obj.mjOBJ_SITE, "S")
    for name in jaws:
        add(kind.mjSENS_JOINTPOS, obj.mjOBJ_JOINT, name)
    for name in jaws:
        add(kind.mjSENS_JOINTVEL, obj.mjOBJ_JOINT, name)
    for name in jaws:
        add(kind.mjSENS_ACTUATORFRC, obj.mjOBJ_ACTUATOR, name)


def _sensor_map(dof: int) -> SensorMap:
    widths = [dof, dof, 3, 4, 3, 3, 2, 2, 2]
    ends = np.cumsum(widths)
    return SensorMap(*(slice(int(e) - w, int(e)) for e, w in zip(ends, widths, strict=True)))


def _handles(model: mujoco.MjModel, description: RobotDescription, objects: int) -> Handles:
    first, last = model.joint(description.joints[0].name), model.joint(description.joints[-1].name)
    jaw = model.joint("jaw_left")
    dof = description.dof
    hand = model.body("hand").id
    assert [model.body(hand + i).name for i in range(4)] == ["hand", "finger_left", "finger_right", "probe"]
    tip_body = int(model.site("tip").bodyid[0])
    assert hand + 3 <= tip_body <= hand + 4
    assert last.dofadr[0] - first.dofadr[0] == dof - 1
    actuator, grip = model.actuator(description.joints[0].name).id, model.actuator("jaw_left").id
    return Handles(
        arm_qpos=slice(int(first.qposadr[0]), int(first.qposadr[0]) + dof),
        arm_dof=slice(int(first.dofadr[0]), int(first.dofadr[0]) + dof),
        arm_ctrl=slice(actuator, actuator + dof),
        jaw_qpos=slice(int(jaw.qposadr[0]), int(jaw.qposadr[0]) + 2),
        jaw_ctrl=slice(grip, grip + 2),
        hand_bodies=slice(hand, hand + 3),
        held_bodies=slice(hand, tip_body + 1),
        probe_body=model.body("probe").id,
        tip_body=tip_body,
        tip_site=model.site("tip").id,
        pads_site=model.site("P").id,
        sensor_site=model.site("S").id,
        object_bodies=tuple(model.body(f"object{i}").id for i in range(objects)),
        container_body=model.body("container").id,
        pad_geoms=(model.geom("pad_left").id, model.geom("pad_right").id),
        sensors=_sensor_map(dof),
    )


def _dress(spec: mujoco.MjSpec, floor_z_m: float) -> None:
    """Add what only a camera sees: light, sky and the arm's pedestal."""
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.42,) * 3, (0.30,) * 3
    spec.visual.quality.shadowsize, spec.visual.map.shadowclip = 4096, 1.6
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=(0.0, -0.5, 1.0), dir=(0.5, 0.45, -1.0), diffuse=(0.55,) * 3,
        specular=(0.15,) * 3,
    )  # fmt: skip
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.75, 0.82, 0.90),
        rgb2=(0.95, 0.96, 0.98),
        width=64,
        height=384,
    )
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=(0.0, 0.0, 0.5 * floor_z_m),
        size=(0.1, abs(0.5 * floor_z_m) + 1e-3, 0.0),
        rgba=(0.4, 0.42, 0.45, 1.0),
        contype=0,
        conaffinity=0,
        group=GROUP_VISUAL,
    )


def build_spec(description: RobotDescription, world: World, truth: Truth) -> mujoco.MjSpec:
    """Assemble the model of one trial; MuJoCo's world frame is B."""
    spec = mujoco.MjSpec()
    spec.modelname = world.name
    spec.compiler.degree = False
    set_options(spec, STEP_S)
    _dress(spec, float(world.container.pose_B_K.position_m[2]))
    hand = add_arm(spec, description, truth.joint_errors_rad)
    add_gripper(spec, hand, description.gripper, truth.pad_friction)
    add_probe(spec, world.probe, world.holder, truth)
    add_container(spec, world.container, truth.pose_B_K)
    for index, item in enumerate(truth.objects):
        add_object(spec, index, item, truth.pose_B_K, fixed=truth.fixed)
    set_softness(spec, truth.contact_s, truth.housing_s)
    _add_sensors(spec, description)
    return spec


def compile_world(description: RobotDescription, world: World, truth: Truth) -> tuple[mujoco.MjModel, Handles]:
    """Build and compile the model; return it with its indices.

    Raises:
        BackendError: MuJoCo refuses the model; cause chained.
    """
    try:
        model = build_spec(description, world, truth).compile()
    except (ValueError, mujoco.FatalError) as e:
        raise BackendError(f"MuJoCo cannot compile the world {world.name!r}: {e}") from e
    return model, _handles(model, description, len(truth.objects))
