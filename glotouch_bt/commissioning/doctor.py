"""Test a robot step by step before its first mission; ask before every motion. Works with any backend.

Each step yields findings: the measurement, a verdict, and advice. The doctor changes no setting of the robot and writes
no files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from glotouch_bt.commissioning.registration import Registration, touch_walls
from glotouch_bt.motion import Arm, Motion, drive
from glotouch_bt.robot import (
    HOLD,
    Array,
    Backend,
    Command,
    Conditions,
    GripperTarget,
    MotionRefused,
    Observation,
    Robot,
    TactileFrame,
    Tare,
    World,
)
from glotouch_bt.robot.scene import stl_files

T = TypeVar("T")
Ask = Callable[[str], bool]

OBSERVE_S = 5.0
"""Duration of a measurement at rest."""
FRAMES_S = 1.5
"""Duration of a measurement of the gel pads."""
MAX_GAP_FACTOR = 3.0
"""Largest gap between samples, relative to the median."""
MIN_RATE_HZ = 900.0
"""Lowest sample rate; guards and onsets are tuned for 1000 Hz."""
MAX_BIAS_N = 5.0
"""Largest force at rest after a tare; beyond it the vendor's torque sensor calibration is needed."""
MAX_NOISE_N = 0.3
"""Largest standard deviation and drift of the force at rest."""
MAX_TARE_PERIODS = 500
"""Longest wait for a tare."""
MAX_KINEMATIC_ERROR_M = 0.005
"""Largest position difference between our and the robot's tool pose."""
MAX_KINEMATIC_ERROR_DEG = 0.5
"""Largest rotation between our and the robot's tool pose."""
JAW_N = 5.0
"""Force of the jaws during the test."""
JAW_M_S = 0.02
"""Speed of the jaws during the test."""
JAW_STEP_M = 0.005
"""First motion of the jaws."""
PRESSED_M = 1e-4
"""Indentation that counts as a press."""


@runtime_checkable
class ObservableBackend(Protocol):
    """A backend that can connect without enabling the robot."""

    def look(self, world: World, conditions: Conditions, options: Mapping[str, object]) -> Robot:
        """Return a robot that can only be observed."""
        ...


@runtime_checkable
class DeviceInformation(Protocol):
    """A robot with information about its devices."""

    info: dict[str, str]


@dataclass(frozen=True)
class DoctorFinding:
    """One finding; `good` is None if it has no verdict."""

    step: str
    what: str
    good: bool | None
    text: str
    values: Mapping[str, Any] = field(default_factory=dict)


def run_and_hold(robot: Robot, motion: Motion[T]) -> T:
    """Run a motion to its end and hold the arm; return the motion's result."""
    try:
        return drive(motion, robot.cycle)
    finally:
        robot.hold()


def rest(robot: Robot, duration_s: float, command: Command = HOLD) -> list[Observation]:
    """Return the observations of a period at rest."""
    return [robot.cycle(command) for _ in range(round(duration_s / robot.period_s))]


def nearly_empty(world: World) -> World:
    """Return a simulated world with one object, the fewest a container can hold."""
    objects = world.objects
    names = objects.names or tuple(stl_files(objects.folder))
    return replace(world, objects=replace(objects, names=names[:1]))


def run_doctor(
    backend: Backend, world: World, conditions: Conditions, options: Mapping[str, object], ask: Ask, *, sure: bool
) -> Iterator[DoctorFinding]:
    """Run all steps; yield each finding as soon as it is known.

    Args:
        backend, world, conditions, options: The robot to open.
        ask: Asks the operator a yes/no question.
        sure: False if no operator can say what they see (a dry run).
    """
    looking = backend.look(world, conditions, options) if isinstance(backend, ObservableBackend) else None
    if looking is not None:
        with looking:
            yield from facts(looking)
            yield from rates(looking)
            yield from wrist(looking, "as found")
        if not ask("So far the arm was only observed. Enable it (the brakes are released, it holds still)?"):
            return
    with backend.open(world, conditions, 0, options) as robot:
        if looking is None:
            yield from facts(robot)
            yield from rates(robot)
        run_and_hold(robot, _tared(robot))
        yield from wrist(robot, "tared")
        yield from place(robot, world)
        if ask(f"Move the jaws by {JAW_STEP_M * 1e3:.0f} mm and then over their stroke, {JAW_N:g} N? Hands off."):
            yield from jaws(robot, ask if sure else None)
        if ask("Read the tactile pads? Nothing may touch them."):
            yield from pads(robot, ask if sure else None)
        if ask("Touch three walls and the floor of the EMPTY container with closed jaws, at a few newtons?"):
            yield from walls(robot, world)


def facts(robot: Robot) -> Iterator[DoctorFinding]:
    """Report the information of the devices."""
    if isinstance(robot, DeviceInformation):
        for name, value in robot.info.items():
            yield DoctorFinding("facts", name, None, value)
    yield DoctorFinding("facts", "description", None, robot.description.name)


def rates(robot: Robot) -> Iterator[DoctorFinding]:
    """Check the sample rate, the gaps between samples, and that the clock runs forward."""
    seen = rest(robot, OBSERVE_S)
    stamps = np.concatenate([o.stamp_s for o in seen])
    steps = np.diff(stamps)
    rate = float(1.0 / steps.mean())
    gap, typical = float(steps.max()), float(np.median(steps))
    forward = bool((steps > 0.0).all())
    yield DoctorFinding(
        "rates", "clock", forward, "runs forward" if forward else "jumped back", {"samples": len(stamps)}
    )
    text = f"{rate:.0f} samples a second; guards and onsets are tuned for 1000"
    yield DoctorFinding("rates", "samples", rate > MIN_RATE_HZ, text, {"rate_Hz": rate})
    text = f"longest gap {gap * 1e3:.1f} ms (usually {typical * 1e3:.1f} ms)"
    yield DoctorFinding("rates", "gaps", gap < max(MAX_GAP_FACTOR * typical, robot.period_s), text, {"gap_s": gap})


def _tared(robot: Robot) -> Motion[None]:
    ticket = robot.start(Tare())
    for _ in range(MAX_TARE_PERIODS):
        yield HOLD
        if ticket.done:
            break


def wrist(robot: Robot, when: str) -> Iterator[DoctorFinding]:
    """Check bias, noise and drift of the wrench at rest."""
    wrench = np.concatenate([o.wrench_S for o in rest(robot, OBSERVE_S)])
    bias, sd = wrench.mean(axis=0), wrench.std(axis=0)
    size = float(np.linalg.norm(bias[:3]))
    good = None if when != "tared" else size < MAX_BIAS_N
    advice = "; tare it again without contact, or calibrate the arm's torque sensors" if good is False else ""
    values = {"bias": bias.round(4).tolist(), "sd": sd.round(5).tolist()}
    yield DoctorFinding("wrist", "bias", good, f"{size:.2f} N {when}{advice}", values)
    worst = float(sd[:3].max())
    text = f"{worst:.3f} N standard deviation on the worst axis (missions were measured at 0.05)"
    yield DoctorFinding("wrist", "noise", worst < MAX_NOISE_N, text, {"sd_N": worst})
    wander = float(np.linalg.norm(wrench[-500:, :3].mean(axis=0) - wrench[:500, :3].mean(axis=0)))
    yield DoctorFinding(
        "wrist", "drift", wander < MAX_NOISE_N, f"{wander:.3f} N over {OBSERVE_S:g} s", {"drift_N": wander}
    )


def place(robot: Robot, world: World) -> Iterator[DoctorFinding]:
    """Compare the tool pose that the robot reports with our kinematics."""
    observation = robot.cycle(HOLD)
    arm = Arm(robot.description, robot.limits, world, robot.period_s)
    ours, theirs = arm.kinematics.fk(observation.q[-1]), observation.pose_B_P
    away = float(np.linalg.norm(ours.position_m - theirs.position_m))
    turned = float(np.degrees(2.0 * np.arccos(min(1.0, abs(float(ours.quat @ theirs.quat))))))
    text = f"the tool is {away * 1e3:.2f} mm and {turned:.2f} deg from where our kinematics have it"
    good = away < MAX_KINEMATIC_ERROR_M and turned < MAX_KINEMATIC_ERROR_DEG
    advice = "" if good else "; use the arm's own calibrated kinematics, and measure the tool"
    yield DoctorFinding("place", "kinematics", good, text + advice, {"away_m": away, "turned_deg": turned})


def jaws(robot: Robot, ask: Ask | None) -> Iterator[DoctorFinding]:
    """Check direction and stroke of the jaws at low force."""
    hand = robot.description.gripper
    first = robot.cycle(HOLD).gripper.aperture_m
    further = first + JAW_STEP_M <= hand.stroke_m
    goal = first + JAW_STEP_M if further else first - JAW_STEP_M
    last = _jaws_to(robot, goal)
    moved = last - first
    good = moved * (goal - first) > 0.0 and abs(last - goal) < 1e-3
    values = {"from_m": first, "to_m": last}
    yield DoctorFinding("jaws", "answer", good, f"commanded {goal * 1e3:.1f} mm, reports {last * 1e3:.1f} mm", values)
    if ask is not None:
        seen = ask(f"Did the jaws {'OPEN' if further else 'CLOSE'}?")
        advice = "" if seen else ": the gripper's scale is reversed; do not run a mission"
        yield DoctorFinding("jaws", "direction", seen, ("as reported" if seen else "not as reported") + advice)
        if not seen:
            return
    shut, wide = _jaws_to(robot, 0.0), _jaws_to(robot, hand.stroke_m)
    text = f"{shut * 1e3:.1f} .. {wide * 1e3:.1f} mm of {hand.stroke_m * 1e3:.0f}"
    good = shut < 2e-3 and wide > hand.stroke_m - 2e-3
    yield DoctorFinding("jaws", "stroke", good, text, {"closed_m": shut, "open_m": wide})
    if ask is not None:
        seen = ask("Are the jaws now fully OPEN?")
        yield DoctorFinding("jaws", "open", seen, "as reported" if seen else "reversed: do not run a mission")


def _jaws_to(robot: Robot, aperture_m: float) -> float:
    """Move the jaws and return their aperture at rest."""
    command = Command(gripper=GripperTarget(aperture_m, JAW_M_S, JAW_N))
    for _ in range(round((0.085 / JAW_M_S + 2.0) / robot.period_s)):
        state = robot.cycle(command).gripper
        command = HOLD
        if abs(state.aperture_m - aperture_m) < 3e-4:
            break
    return float(np.mean([o.gripper.aperture_m for o in rest(robot, 0.3)]))


def pads(robot: Robot, ask: Ask | None) -> Iterator[DoctorFinding]:
    """Check rate, noise and dead taxels of the untouched pads; then where a press is seen."""
    frames = _frames(robot)
    if len(frames) < 2:
        yield DoctorFinding("pads", "frames", False, f"{len(frames)} frames in {FRAMES_S:g} s")
        return
    rate = (len(frames) - 1) / (frames[-1].stamp_s - frames[0].stamp_s)
    yield DoctorFinding("pads", "frames", rate > 10.0, f"{rate:.0f} pairs a second", {"rate_Hz": rate})
    for side in ("left", "right"):
        maps = np.array([getattr(f, f"{side}_m") for f in frames])
        alive = ~np.isnan(maps).any(axis=0)
        dead, seen = 1.0 - float(alive.mean()), maps[:, alive]
        noise = float(np.median(seen.std(axis=0))) if seen.size else np.nan
        offset = float(np.median(np.abs(seen))) if seen.size else np.nan
        text = f"noise {noise * 1e3:.3f} mm, offset {offset * 1e3:.3f} mm, {dead * 100:.1f} % of the taxels dead"
        good = dead < 0.05 and offset < PRESSED_M
        yield DoctorFinding("pads", side, good, text, {"noise_m": noise, "offset_m": offset, "dead": dead})
    if ask is None:
        return
    words = "Press the LEFT pad (the one at +y of P) with a finger, near its tip, on the side of +x of P. Pressing?"
    if not ask(words):
        return
    pressed = _frames(robot)
    if pressed:
        yield _pressed(frames[-1], pressed[-1])


def _frames(robot: Robot) -> list[TactileFrame]:
    seen = rest(robot, FRAMES_S, Command(tactile=True))
    return [o.tactile for o in seen if o.tactile is not None]


def _pressed(before: TactileFrame, now: TactileFrame) -> DoctorFinding:
    """Check the place of a press, which must be on the left map, in the lower half of the rows, at high columns."""
    found = {}
    for side in ("left", "right"):
        change: Array = np.nan_to_num(getattr(now, f"{side}_m") - getattr(before, f"{side}_m"))
        i, j = np.unravel_index(int(change.argmax()), change.shape)
        found[side] = float(change.max()), int(i) / change.shape[0], int(j) / change.shape[1]
    side = max(found, key=lambda s: found[s][0])
    depth, row, column = found[side]
    if depth < PRESSED_M:
        return DoctorFinding("pads", "press", False, "no press was seen on either pad")
    wrong = [] if side == "left" else ["the pads are swapped: exchange left_pad and right_pad"]
    if row < 0.5:
        wrong.append("rows run towards the flange: mount or number the sensor the other way round")
    if column < 0.5:
        wrong.append("columns are mirrored: set mirror to the other pad")
    text = f"seen on the {side} map, {row * 100:.0f} % down and {column * 100:.0f} % along +x"
    values = {"side": side, "row": row, "column": column, "depth_m": depth}
    return DoctorFinding("pads", "press", not wrong, "; ".join([text, *wrong]), values)


def walls(robot: Robot, world: World) -> Iterator[DoctorFinding]:
    """Register the container by touch."""
    arm = Arm(robot.description, robot.limits, world, robot.period_s)
    arm.sync(robot.observe())
    _jaws_to(robot, 0.0)
    try:
        found = run_and_hold(robot, touch_walls(arm, world, robot.observe))
    except MotionRefused as e:
        yield DoctorFinding("walls", "touch", False, str(e))
        return
    if isinstance(found, str):
        yield DoctorFinding("walls", "touch", False, found)
        return
    yield _registered(found)


def _registered(found: Registration) -> DoctorFinding:
    x, y, z = (1e3 * found.shift_K_m).tolist()
    yaw = float(np.degrees(found.yaw_rad))
    where, turn = found.pose_B_K.position_m.round(4).tolist(), float(np.degrees(found.pose_B_K.yaw_rad))
    text = (
        f"the container is {x:+.1f}, {y:+.1f}, {z:+.1f} mm and {yaw:+.2f} deg from its pose in the world file "
        f"(touches agree within {found.residual_m * 1e3:.2f} mm, at most {found.peak_N:.1f} N); "
        f"pose_B_K: {{position_m: {where}, yaw_deg: {turn:.2f}}}"
    )
    values = {"shift_K_m": found.shift_K_m.tolist(), "yaw_deg": yaw, "residual_m": found.residual_m}
    values |= {"peak_N": found.peak_N, "position_m": where, "pose_yaw_deg": turn}
    return DoctorFinding("walls", "container", found.residual_m < 2e-3, text, values)
