"""Guards of signals that are within every limit and yet none: dead lines, frozen maps, clipped or drowned forces.

What a sensor's noise looks like is learnt while it works. A noise-free signal, as of an ideal simulation, teaches
nothing, so that its standing still is no finding.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.observation import Observation, TactileFrame
from glotouch_bt.robot.supervision.limits import Finding, Patience, SupervisionLimits

LIVE_FRAMES, FROZEN_FRAMES = 5, 3
"""Pads are noisy after so many different pairs of maps without a touch; so many equal ones then are frozen."""
UNTOUCHED_N = 0.5


class WristWatch:
    """The wrist force sensor, once a period."""

    def __init__(self, period_s: float, rules: SupervisionLimits, patience: Patience) -> None:
        self._period_s, self._rules, self._patience = period_s, rules, patience
        self._share = period_s / rules.noise_over_s
        self._noted_s = -np.inf
        self.forget()

    def forget(self) -> None:
        """Learn anew."""
        self._noisy_periods = self._same_periods = 0
        self._noise_N = 0.0

    def look(self, o: Observation, found: list[Finding]) -> None:
        """One block; a noisy sensor never gives a component twice, but for its resolution."""
        w = o.wrench_S
        first, newest = w[0], w[-1]
        if np.count_nonzero(first == newest) and len(w) > 1:
            self._look_for_stuck(w, o.now_s, found)
        else:
            self._same_periods = 0
            change = abs(newest.item(0) - first.item(0))
            self._noisy_periods = self._noisy_periods + 1 if change > self._rules.noise_N else 0
        step = abs(newest.item(0) - w[-2].item(0)) if len(w) > 1 else 0.0
        self._noise_N += self._share * (step - self._noise_N)
        if self._noise_N > self._rules.max_noise_N:
            self._note_noise(o.now_s, found)

    def _look_for_stuck(self, w: Array, stamp_s: float, found: list[Finding]) -> None:
        rules = self._rules
        constant = (w == w[-1]).all(axis=0)
        if not constant.any():
            return
        noisy = self._noisy_periods * self._period_s >= rules.noisy_s
        if not constant.all():
            if noisy:
                names = [n for n, c in zip(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), constant, strict=True) if c]
                what = f"{', '.join(names)} stand still while the others do not: clipped, or a line is dead"
                fatal = self._patience.ends("wrench_stuck", stamp_s)
                found.append(Finding("wrench_stuck", what, float(len(names)), 0.0, stamp_s, fatal))
            return
        self._same_periods += 1
        same_s = self._same_periods * self._period_s
        if noisy:
            fatal = self._patience.ends("wrench_stuck", stamp_s) or same_s >= rules.stuck_s
            what = f"the wrench has been the same to the bit for {same_s:.2f} s, it was noisy before"
            found.append(Finding("wrench_stuck", what, same_s, rules.stuck_s, stamp_s, fatal))
        elif same_s >= rules.stuck_s:
            self._noisy_periods = 0

    def _note_noise(self, stamp_s: float, found: list[Finding]) -> None:
        """Only put on record, once a window: what it spoils, a skill notices; what it does not is done."""
        if stamp_s - self._noted_s < self._rules.window_s:
            return
        self._noted_s = stamp_s
        limit = self._rules.max_noise_N
        what = f"the force jumps by {self._noise_N:.2f} N from sample to sample, {limit:.2f} N are expected at most"
        found.append(Finding("wrench_noise", what, self._noise_N, limit, stamp_s, fatal=False))


class PadWatch:
    """The depth maps, while they are asked for."""

    def __init__(self, rules: SupervisionLimits, patience: Patience) -> None:
        self._rules, self._patience = rules, patience
        self.forget()

    def forget(self) -> None:
        """Learn anew."""
        self._since_s: float | None = None
        self._last: TactileFrame | None = None
        self._different = self._equal = 0

    @property
    def asked(self) -> bool:
        """Maps should come."""
        return self._since_s is not None

    def told(self, tactile: bool, now_s: float) -> None:
        """Whether the coming block should bring maps."""
        if not tactile:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s

    def look(self, o: Observation, found: list[Finding]) -> None:
        """One block."""
        now_s, limit, frame = o.now_s, self._rules.tactile_age_s, o.tactile
        since_s = now_s if self._since_s is None else self._since_s
        if frame is None or frame.stamp_s < since_s - limit:  # also one from before it was asked for
            waited = now_s - since_s
            if waited > limit:
                what = f"no depth map for {waited:.3f} s although they were asked for"
                found.append(Finding("tactile_stale", what, waited, limit, now_s))
            return
        self._since_s = now_s
        if now_s - frame.stamp_s > limit:
            age = now_s - frame.stamp_s
            found.append(Finding("tactile_stale", f"a depth map is {age:.3f} s old", age, limit, now_s))
        self._look_for_dead(frame, now_s, found)
        self._look_for_frozen(frame, o.gripper.force_N < UNTOUCHED_N, now_s, found)

    def _look_for_dead(self, frame: TactileFrame, now_s: float, found: list[Finding]) -> None:
        for side, depth in (("left", frame.left_m), ("right", frame.right_m)):
            live = float(np.count_nonzero(np.isfinite(depth))) / depth.size
            if live < self._rules.live_taxels or np.isinf(depth).any():
                fatal = self._patience.ends("tactile_dead", now_s)
                what = f"{100.0 * live:.0f} % of the {side} pad give numbers"
                found.append(Finding("tactile_dead", what, live, self._rules.live_taxels, now_s, fatal))

    def _look_for_frozen(self, frame: TactileFrame, untouched: bool, now_s: float, found: list[Finding]) -> None:
        last, self._last = self._last, frame
        if last is None:
            return
        pairs = ((frame.left_m, last.left_m), (frame.right_m, last.right_m))
        if not all(np.array_equal(now, before, equal_nan=True) for now, before in pairs):
            self._equal = 0
            self._different += untouched
            return
        if self._different < LIVE_FRAMES:
            self._different = 0
            return
        self._equal += 1
        if self._equal >= FROZEN_FRAMES:
            what = f"{self._equal + 1} depth maps are the same to the bit, they were noisy before"
            found.append(Finding("tactile_frozen", what, float(self._equal), float(FROZEN_FRAMES), now_s))
