"""Guards of readings that are within every limit but carry no signal: dead lines, frozen maps, clipped or noisy forces.

They learn a sensor's noise while it works. A noise-free signal, as of an ideal simulation, teaches nothing and may
stand still.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.observation import Observation, TactileFrame
from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits, TransientCounter

MIN_TURNS = 2
"""Minimum number of turning points of a noisy force in a block; ten samples of white noise have five. Source: ours."""
MIN_NOISY_FRAMES = 5
"""Pads count as noisy after this many different pairs of maps without a touch. Source: ours."""
MAX_EQUAL_FRAMES = 3
"""Noisy pads that repeat a pair this many times are frozen. Source: ours."""
MAX_UNTOUCHED_N = 0.5
"""Below this jaw force nothing touches the pads. Source: ours."""


@compiled("given f8[:, :]")
def _repeats(w: Array) -> tuple[bool, float]:
    """Return True if the last of several samples repeats a component of the first, and the last step of the force."""
    n = len(w)
    if n < 2:
        return False, 0.0
    repeated = False
    for i in range(w.shape[1]):
        repeated |= w[0, i] == w[n - 1, i]
    return repeated, abs(w[n - 1, 0] - w[n - 2, 0])


class WrenchSignalGuard:
    """Check the noise of the wrist force sensor once a period."""

    def __init__(self, period_s: float, guard_limits: SupervisionLimits, transients: TransientCounter) -> None:
        self._period_s, self._guard_limits, self._transients = period_s, guard_limits, transients
        self._share = period_s / guard_limits.noise_over_s
        self._noted_s = -np.inf
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt about the noise."""
        self._noisy_periods = self._same_periods = 0
        self._noise_N = 0.0

    def check(self, o: Observation, findings: list[GuardFinding]) -> None:
        """Check one block: a noisy sensor never repeats a component, except within its resolution."""
        w = o.wrench_S
        repeated, step = _repeats(w)
        if repeated:
            self._check_stuck(w, o.now_s, findings)
        else:
            self._same_periods = 0
            if not self._noisy:
                self._noisy_periods = self._noisy_periods + 1 if self._restless(w) else 0
        self._noise_N += self._share * (step - self._noise_N)
        if self._noise_N > self._guard_limits.max_noise_N:
            self._record_noise(o.now_s, findings)

    @property
    def _noisy(self) -> bool:
        return self._noisy_periods * self._period_s >= self._guard_limits.noisy_s

    def _restless(self, w: Array) -> bool:
        """Return True if the force goes up and down within a block, as noise does and a motion does not."""
        steps = np.diff(w[:, 0])
        steps = steps[np.abs(steps) > self._guard_limits.noise_N]
        return bool(np.count_nonzero(steps[1:] * steps[:-1] < 0.0) >= MIN_TURNS)

    def _check_stuck(self, w: Array, stamp_s: float, findings: list[GuardFinding]) -> None:
        guard_limits = self._guard_limits
        constant = (w == w[-1]).all(axis=0)
        if not constant.any():
            return
        noisy = self._noisy
        if not constant.all():
            if noisy:
                names = [n for n, c in zip(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), constant, strict=True) if c]
                what = f"{', '.join(names)} stand still while the others do not: clipped, or a dead line"
                fatal = self._transients.exceeded("wrench_stuck", stamp_s)
                findings.append(GuardFinding("wrench_stuck", what, float(len(names)), 0.0, stamp_s, fatal))
            return
        self._same_periods += 1
        same_s = self._same_periods * self._period_s
        if noisy:
            fatal = self._transients.exceeded("wrench_stuck", stamp_s) or same_s >= guard_limits.stuck_s
            what = f"the wrench has been bit-identical for {same_s:.2f} s; it was noisy before"
            findings.append(GuardFinding("wrench_stuck", what, same_s, guard_limits.stuck_s, stamp_s, fatal))
        elif same_s >= guard_limits.stuck_s:
            self._noisy_periods = 0

    def _record_noise(self, stamp_s: float, findings: list[GuardFinding]) -> None:
        """Record noise once a window; it never ends a mission, because a skill notices when it cannot work with it."""
        if stamp_s - self._noted_s < self._guard_limits.window_s:
            return
        self._noted_s = stamp_s
        limit = self._guard_limits.max_noise_N
        what = f"the force jumps by {self._noise_N:.2f} N from sample to sample; at most {limit:.2f} N are expected"
        findings.append(GuardFinding("wrench_noise", what, self._noise_N, limit, stamp_s, fatal=False))


class TactileSignalGuard:
    """Check the depth maps while they are requested."""

    def __init__(self, guard_limits: SupervisionLimits, transients: TransientCounter) -> None:
        self._guard_limits, self._transients = guard_limits, transients
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt about the noise."""
        self._since_s: float | None = None
        self._last: TactileFrame | None = None
        self._different = self._equal = 0

    @property
    def asked(self) -> bool:
        """True while maps are requested."""
        return self._since_s is not None

    def on_command(self, tactile: bool, now_s: float) -> None:
        """Note whether the next block should contain maps."""
        if not tactile:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s

    def check(self, o: Observation, findings: list[GuardFinding]) -> None:
        """Check one block."""
        now_s, limit, frame = o.now_s, self._guard_limits.tactile_age_s, o.tactile
        since_s = now_s if self._since_s is None else self._since_s
        if frame is None or frame.stamp_s < since_s - limit:  # also one taken before the request
            waited = now_s - since_s
            if waited > limit:
                what = f"no depth map for {waited:.3f} s although they were requested"
                findings.append(GuardFinding("tactile_stale", what, waited, limit, now_s))
            return
        self._since_s = now_s
        if now_s - frame.stamp_s > limit:
            age = now_s - frame.stamp_s
            findings.append(GuardFinding("tactile_stale", f"a depth map is {age:.3f} s old", age, limit, now_s))
        self._check_dead(frame, now_s, findings)
        self._check_frozen(frame, o.gripper.force_N < MAX_UNTOUCHED_N, now_s, findings)

    def _check_dead(self, frame: TactileFrame, now_s: float, findings: list[GuardFinding]) -> None:
        for side, depth in (("left", frame.left_m), ("right", frame.right_m)):
            live = float(np.count_nonzero(np.isfinite(depth))) / depth.size
            if live < self._guard_limits.live_taxels or np.isinf(depth).any():
                fatal = self._transients.exceeded("tactile_dead", now_s)
                what = f"{100.0 * live:.0f} % of the {side} pad deliver numbers"
                findings.append(GuardFinding("tactile_dead", what, live, self._guard_limits.live_taxels, now_s, fatal))

    def _check_frozen(self, frame: TactileFrame, untouched: bool, now_s: float, findings: list[GuardFinding]) -> None:
        last, self._last = self._last, frame
        if last is None:
            return
        pairs = ((frame.left_m, last.left_m), (frame.right_m, last.right_m))
        if not all(np.array_equal(now, before, equal_nan=True) for now, before in pairs):
            self._equal = 0
            self._different += untouched
            return
        if self._different < MIN_NOISY_FRAMES:
            self._different = 0
            return
        self._equal += 1
        if self._equal >= MAX_EQUAL_FRAMES:
            what = f"{self._equal + 1} depth maps are bit-identical; they were noisy before"
            findings.append(GuardFinding("tactile_frozen", what, float(self._equal), float(MAX_EQUAL_FRAMES), now_s))
