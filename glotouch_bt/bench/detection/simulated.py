"""The contact guard in simulation: the real prober in free motion, and with a known force on the ball."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from py_trees.blackboard import Blackboard
from py_trees.common import Status

from glotouch_bt.bench.detection.signals import wrong
from glotouch_bt.mission.read import SkillRegistry, load_conditions, load_world
from glotouch_bt.motion import Arm, Motion, drive
from glotouch_bt.perception.touch import GuardParams, Payload
from glotouch_bt.robot import HOLD, Array, BadInput, Command, MotionRefused, Observation, Robot, load_backend
from glotouch_bt.robot.scene import stl_files
from glotouch_bt.robot.simulation import Referee
from glotouch_bt.skill import Context
from glotouch_bt.skill.probing import HeldTool, Probed, Prober

WORLD, CORNER_K = "container_five", (0.075, 0.13, 0.0)
"""World, and the pose of its only object, in a corner out of the way."""
LOW_M = 0.03
"""Lowest height of the ball above the floor in free motion."""
HIGH_M = 0.12
"""Greatest height of the ball above the floor in free motion."""
CLEAR_M = 0.03
"""Clearance from the walls and from the half with the object."""


@dataclass(frozen=True)
class PushTrial:
    """Result of one push on the ball.

    Attributes:
        found: The prober reported a contact during the push.
        early: The prober reported a contact before the push.
        late_s: Delay from the start of the push to the dated onset; NaN if not found.
    """

    found: bool
    early: bool
    late_s: float


class SimulatedProbe:
    """A simulated robot that holds the probe.

    Args:
        conditions: Path or shipped name.
        seed: Seed of the trial.
        backend: Registered name.

    Raises:
        BadInput: A backend without a referee, which cannot push.
    """

    def __init__(self, conditions: str, seed: int, backend: str = "mujoco") -> None:
        world = load_world(WORLD)
        one = tuple(stl_files(world.objects.folder))[:1]
        self.world = dataclasses.replace(world, objects=dataclasses.replace(world.objects, names=one))
        made = load_backend(backend)
        known = load_conditions(conditions)
        self.robot: Robot = made.open(self.world, known, seed, {"layout": {one[0]: CORNER_K}})
        referee = made.referee(self.robot)
        if referee is None:
            raise BadInput(f"backend {backend!r} has no referee; bench detection needs a simulation")
        self.referee: Referee = referee
        self.arm = Arm(self.robot.description, self.robot.limits, self.world, self.robot.period_s)
        self.arm.sync(self.robot.observe())
        self.context = Context(self.world, self.arm, self.robot, self, self.robot.observe())
        self.rng = np.random.default_rng([seed, 11])
        self.tool: HeldTool = self._pick_up()
        carried = wrong(Payload.hand(self.arm.description.gripper, self.world.probe), known, self.rng)
        self.prober = Prober(self.context, self.tool, GuardParams(), carried=carried)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Discard the event."""

    def _pick_up(self) -> HeldTool:
        pickup = SkillRegistry()["tool_pickup"]
        skill = pickup("pickup", pickup.Params(), self.context)
        keys = {port: f"/detection/{id(self)}/{key}" for port, key in pickup.default_keys().items()}
        skill.setup_ports(keys)
        while True:
            self.context.command = HOLD
            skill.tick_once()
            if skill.status is not Status.RUNNING:
                break
            self.context.observation = self.robot.cycle(self.context.command)
        if skill.status is not Status.SUCCESS:
            raise BadInput(f"the probe could not be picked up: {skill.feedback_message}")
        tool = Blackboard.get(keys["tool"])
        Blackboard.unset(keys["tool"])
        assert isinstance(tool, HeldTool)
        return tool

    def go(self, motion: Motion[Any], before: Callable[[Observation], None] | None = None) -> Any:
        """Run a motion to its end; call `before` with the newest observation before each period."""

        def cycle(command: Command) -> Observation:
            if before is not None:
                before(self.context.observation)
            self.context.observation = self.robot.cycle(command)
            return self.context.observation

        return drive(motion, cycle)

    def place(self, low_m: float = LOW_M) -> Array:
        """Draw a position (3,) of the ball in the empty half of the container, in K."""
        half = 0.5 * np.array(self.world.container.interior_m[:2]) - CLEAR_M
        x, y = self.rng.uniform(-half, [half[0], CORNER_K[1] - 3 * CLEAR_M])
        return np.array([x, y, self.rng.uniform(low_m, HIGH_M)])


@dataclass(frozen=True)
class FreeMotion:
    """Counts of guarded moves in free space.

    Attributes:
        false_contacts: Number of moves that reported a contact.
        moves: Number of moves.
        guarded_s, total_s: Guarded and total simulated time.
    """

    false_contacts: int
    moves: int
    guarded_s: float
    total_s: float


def free_motion(rig: SimulatedProbe, guarded_for_s: float) -> FreeMotion:
    """Make sweeps, steps and vertical moves at exploration speeds, 40-50 mm/s, for `guarded_for_s` of guarded time."""
    rig.go(rig.prober.hop(rig.place(), HIGH_M, 0.10))
    began = rig.context.observation.now_s
    false, moves, guarded_s = 0, 0, 0.0
    while guarded_s < guarded_for_s:
        here, goal = rig.prober.tip_K_m, rig.place()
        kind = ("across", "step", "vertical", "oblique")[int(rig.rng.choice(4, p=[0.5, 0.2, 0.2, 0.1]))]
        if kind == "vertical":
            goal[:2] = here[:2]
        elif kind != "oblique":
            goal[2] = here[2]
        if kind == "step":
            goal = here + 0.02 * (goal - here) / max(float(np.linalg.norm(goal - here)), 1e-9)
        try:
            probed: Probed = rig.go(rig.prober.move(goal, rig.rng.uniform(0.04, 0.05), any_direction=kind == "step"))
        except MotionRefused:
            continue
        moves += 1
        guarded_s += len(probed.path_K_m) * rig.robot.period_s
        if probed.contact is not None:
            false += 1
            rig.go(rig.prober.rest())
    return FreeMotion(false, moves, guarded_s, rig.context.observation.now_s - began)


def push_once(rig: SimulatedProbe, force_N: float, kind: str, grows_s: float) -> PushTrial:
    """Make a guarded move of 50 mm, across or down, while a force ramps up on the ball from a random time."""
    while True:
        start = np.array([*rig.place()[:2], HIGH_M])
        bearing = rig.rng.uniform(0.0, 2 * np.pi)
        way = np.array([0.0, 0.0, -1.0]) if kind == "down" else np.array([np.cos(bearing), np.sin(bearing), 0.0])
        try:
            rig.go(rig.prober.hop(start, HIGH_M, 0.10))
            move = rig.prober.move(start + 0.05 * way, 0.04)
            rig.go(rig.prober.rest())
            begins = rig.context.observation.now_s + round(float(rig.rng.uniform(0.3, 0.7)), 2)
            against_B = -(rig.world.container.pose_B_K.rotation @ way)

            def push(observation: Observation, begins: float = begins, against_B: Array = against_B) -> None:
                share = float(np.clip((observation.now_s - begins + 0.002) / grows_s, 0.0, 1.0))
                rig.referee.push_tip(force_N * share * against_B)  # for the coming period

            probed: Probed = rig.go(move, push)
        except MotionRefused:
            continue
        finally:
            rig.referee.push_tip(np.zeros(3))
        rig.go(rig.prober.rest())
        contact = probed.contact
        early = contact is not None and contact.stamp_s < begins - 0.02
        late = float("nan") if contact is None else contact.stamp_s - begins
        return PushTrial(contact is not None and not early, early, late)
