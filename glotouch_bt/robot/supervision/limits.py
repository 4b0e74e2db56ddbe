"""What supervision below the tree tolerates: frozen values, each with its source."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.robot.errors import ParamError

GUARDS = {
    "not_finite": "a reading that is no number (single samples are dropped)",
    "stamps": "samples that do not follow each other in time (single samples are dropped)",
    "samples_missing": "less than a quarter of the samples that a control period has, again and again",
    "overrun": "control periods that passed without a command while the arm moved, very many or again and again",
    "joint_range": "a joint measured outside its range",
    "joint_speed": "a joint measured faster than its limit",
    "out_of_reach": "a pose that no arm of this size has, or a rotation that is none",
    "wrench": "a sensed wrench beyond the hard limit, sample after sample",
    "wrench_stuck": "a noisy wrench sensor of which some or all components stand still",
    "wrench_noise": "a force that jumps from sample to sample (only put on record)",
    "following": "the hand is not where it was told to be",
    "gripper_stale": "the gripper does not report any more",
    "tactile_stale": "depth maps were asked for and do not come",
    "tactile_frozen": "noisy depth maps that come again and again",
    "tactile_dead": "depth maps with hardly a live taxel, or with infinities, again and again",
    "command": "a setpoint or a jaw target that is not finite, out of range, or a jump",
    "device": "the device or its driver failed",
}
"""Every guard by name, with what trips it."""


@dataclass(frozen=True, kw_only=True)
class SupervisionLimits:
    """Limits of the guards; the joints' own, the hard wrench and the speeds are the robot's (`Limits`, `Joint`).

    Attributes:
        joint_slack_rad: A joint may be measured so far beyond its range. Source: ours, 1 degree: a setpoint at the
            stop and the servo's error.
        speed_slack: Measured against allowed joint speed. Source: ours; differentiated encoders are noisy.
        reach_m: No part of the hand is farther from the base. Source: twice the reach of the largest supported arm.
        start_rad: After a hold, a setpoint may begin so far from where a joint is measured. Source: ours, 3 degrees.
        wrench_samples: Samples in a row beyond the hard wrench limit. Source: that of the simulated backend's own
            guard, 5 ms: what is shorter is the sensor's noise or the ringing of a stop.
        following_m, following_rad: Largest distance of the hand from where it was told to be, and angle. The hand's,
            not the joints': a device that is sent poses finds its own posture for them. Source: ten times what was
            measured in a whole retrieval (harsh, MuJoCo): 0.5 mm at 8 N, 0.003 rad.
        touching_N, touching_m: While at least this force is sensed, the hand may only be so far from there: a servo
            that does not follow presses more with every millimetre. Source: twice what whole retrievals show beyond
            4 N (MuJoCo, nominal: 0.8 mm, in one that pressed sideways with 11 N 1.7 mm).
        lag_s: It may be where it was told to be so long ago. Source: ours, driver 30 ms (its hold) and servo, doubled.
        command_slack: Commanded against allowed speeds. Source: ours, rounding and the end of a profile.
        gripper_age_s, tactile_age_s: Oldest report, and longest wait for a depth map that was asked for. Source:
            `Limits.max_age_s`, five times the slowest gripper of CONDITIONS, twice its slowest depth maps.
        stuck_s: Bit-identical wrench samples for so long. Source: ours, a third of the shortest rest a probing skill
            listens at (120 ms).
        noisy_s: A sensor counts as noisy after so long without one repeated or (`noise_N`) unchanged force: only then
            may it be called stuck. Noise-free simulations never get there. Source: ours.
        noise_N: A change between two periods that is less is no noise. Source: ours, a fiftieth of the force sensors'
            resolution.
        max_noise_N, noise_over_s: Mean jump of a force component from sample to sample, over so long. Source: three
            times that of harsh CONDITIONS (0.15 N sd jump by 0.17 N).
        live_taxels: Least share of a pad that gives numbers. Source: harsh CONDITIONS have 3 % dead; half of a pad
            cannot be matched.
        late_periods: The arm may wait for so many periods while it moves, and samples of so many may be missing within
            `window_s`. Source: that of the watchdog (0.25 s). The device holds by itself meanwhile (the driver after
            30 ms), and looks at the hard limit.
        held_periods: A wait of so many periods has made the device hold. Source: the driver does after 30 ms. Shorter
            ones are only put on record.
        tolerated: Findings of one transient kind within `window_s` that are only put on record.
        window_s: See `tolerated`.
    """

    joint_slack_rad: float = 0.02
    speed_slack: float = 1.2
    reach_m: float = 3.0
    start_rad: float = 0.05
    wrench_samples: int = 5
    following_m: float = 0.006
    following_rad: float = 0.03
    touching_N: float = 8.0
    touching_m: float = 0.003
    lag_s: float = 0.1
    command_slack: float = 1.1
    gripper_age_s: float = 0.2
    tactile_age_s: float = 0.2
    stuck_s: float = 0.04
    noisy_s: float = 5.0
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
class Finding:
    """What a guard found.

    Attributes:
        guard: A key of `GUARDS`.
        what: One clause, with units and what is valid.
        value: What was found.
        limit: What it passed.
        stamp_s: Robot clock.
        fatal: It ends the mission; else it is only put on record.
    """

    guard: str
    what: str
    value: float
    limit: float
    stamp_s: float
    fatal: bool = True


class Patience:
    """Counts findings of one transient kind; patience ends when too many came within the window."""

    def __init__(self, limits: SupervisionLimits) -> None:
        self._most, self._window_s = limits.tolerated, limits.window_s
        self._stamps: dict[str, list[float]] = {}

    def ends(self, guard: str, stamp_s: float, count: int = 1) -> bool:
        """Take `count` findings of a guard; True if there are too many of them now."""
        recent = [s for s in self._stamps.get(guard, ()) if 0.0 <= stamp_s - s < self._window_s]
        recent += [stamp_s] * count
        self._stamps[guard] = recent
        return len(recent) > self._most
