"""Limits of the guards: frozen values, each with its source."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.errors import ParamError


@dataclass(frozen=True, kw_only=True)
class SupervisionLimits:
    """Limits of the guards. The joints' limits, the hard wrench and the speeds are those of the robot (`Limits`,
    `Joint`).

    Attributes:
        joint_slack_rad: Distance by which a joint may be measured beyond its range. Source: ours, 1 degree: a setpoint
            at the limit plus the servo's error.
        speed_slack: Measured over allowed joint speed. Source: ours; differentiated encoders are noisy.
        reach_m: Largest distance of the hand from the base. Source: twice the reach of the largest supported arm.
        start_rad: After a hold, largest distance of a setpoint from the measured joint. Source: ours, 3 degrees.
        wrench_samples: Consecutive samples beyond the stop limit of the wrench that trip the guard. Source: the
            simulated backend's own limit, 5 ms; shorter peaks are noise or the ringing of a stop.
        following_m, following_rad: Largest distance and angle between the hand's measured and commanded pose. The
            joints are not compared: a device that is sent poses chooses its own posture. Source: ten times the values
            measured in a whole retrieval (harsh, MuJoCo): 0.5 mm at 8 N, 0.003 rad.
        following_periods: A hand that leaves its path must also be within these distances so many periods later, at
            its present speed away from it. Source: ours, the periods until a stop takes effect, doubled. Undisturbed
            hands leave their paths at 20 mm/s at most.
        touching_N, touching_m: Above this force only this distance is allowed, because a servo that does not follow
            presses harder with every millimetre. Source: twice the distance measured in whole retrievals beyond 4 N
            (MuJoCo, nominal: 0.8 mm; 1.7 mm in one that pressed sideways with 11 N).
        lag_s: The hand may be where it was commanded to be this long ago. Source: ours, the driver's 30 ms hold and the
            servo's lag, doubled.
        command_slack: Commanded over allowed speed. Source: ours, rounding and the end of a profile.
        gripper_age_s, tactile_age_s: Oldest gripper report, longest wait for a requested depth map. Source:
            `Limits.max_age_s`; over six times the slowest gripper and twice the slowest depth maps of
            conditions/harsh.yaml.
        stuck_s: Duration of bit-identical wrench samples. Source: ours, a third of the shortest rest at which a probing
            skill averages the force (120 ms).
        noisy_s: A sensor counts as noisy after this time in which the force went up and down in every period by more
            than `noise_N`; only a noisy sensor can be stuck. Noise-free simulations never reach it. Source: ours.
        proof_N2: Sum over periods of the squared inertial force of the hand after which the wrist must have shown it.
            Source: ours; 40 ms at the largest acceleration, before the hand moves at 0.1 m/s.
        silent_share: Least share of that sum. Source: ours; a delay of 0.05 s leaves a tenth, one of 0.1 s nothing.
        noise_N: A smaller change between two periods is not noise. Source: ours, a fiftieth of the sensors' resolution.
        max_noise_N, noise_over_s: Mean jump of a force component from sample to sample, over this time. Source: three
            times that of conditions/harsh.yaml (noise of 0.15 N sd jumps by 0.17 N).
        live_taxels: Smallest share of a pad that delivers numbers. Source: conditions/harsh.yaml has 3 % dead
            taxels; half of a pad cannot be matched.
        late_periods: Longest wait of a moving arm, and most missing samples within `window_s`, in periods. Source: the
            watchdog's 0.25 s. The device meanwhile holds (the driver after 30 ms) and enforces the hard limit.
        held_periods: Wait after which the device has held by itself. Source: the driver's 30 ms. Shorter waits are only
            recorded.
        tolerated: Findings of one transient kind within `window_s` that are only recorded.
        window_s: See `tolerated`.
    """

    joint_slack_rad: float = 0.02
    speed_slack: float = 1.2
    reach_m: float = 3.0
    start_rad: float = 0.05
    wrench_samples: int = 5
    following_m: float = 0.006
    following_rad: float = 0.03
    following_periods: float = 4.0
    touching_N: float = 8.0
    touching_m: float = 0.003
    lag_s: float = 0.1
    command_slack: float = 1.1
    gripper_age_s: float = 0.2
    tactile_age_s: float = 0.2
    stuck_s: float = 0.04
    noisy_s: float = 2.0
    proof_N2: float = 3.0
    silent_share: float = 0.05
    noise_N: float = 1e-6
    max_noise_N: float = 0.5
    noise_over_s: float = 0.3
    live_taxels: float = 0.5
    late_periods: float = 25.0
    held_periods: float = 3.0
    tolerated: int = 5
    window_s: float = 1.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not (math.isfinite(value) and value > 0):
                raise ParamError(f"supervision.{f.name}", value, "finite and positive")


@dataclass(frozen=True)
class GuardFinding:
    """One finding of a guard.

    Attributes:
        guard: Its name; docs/explanation/supervision.md lists them.
        what: One clause with units and the valid range.
        value: The offending value.
        limit: What it passed.
        stamp_s: Robot clock.
        fatal: True if it ends the mission, False if it is only recorded.
    """

    guard: str
    what: str
    value: float
    limit: float
    stamp_s: float
    fatal: bool = True


class TransientCounter:
    """Count transient findings of each guard within a sliding window."""

    def __init__(self, limits: SupervisionLimits) -> None:
        self._max_findings, self._window_s = limits.tolerated, limits.window_s
        self._stamps: dict[str, list[float]] = {}

    def exceeded(self, guard: str, stamp_s: float, count: int = 1) -> bool:
        """Add `count` findings of a guard; return True if there are too many within the window."""
        recent = [s for s in self._stamps.get(guard, ()) if 0.0 <= stamp_s - s < self._window_s]
        recent += [stamp_s] * count
        self._stamps[guard] = recent
        return len(recent) > self._max_findings
