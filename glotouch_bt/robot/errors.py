"""Every error this project raises has one root, carries data, and says what was expected.

GlotouchError
+-- BadInput            the user's file, option or mesh is wrong; nothing moved     (exit 2)
|   +-- ParamError      one named value breaks one stated rule
|   +-- UnknownName     a name nobody registered; lists the valid ones
+-- MissionFailed       the mission ran and did not reach its goal                  (exit 1)
+-- MotionRefused       a plan that would collide or leave the joint limits; not tried
+-- BackendError        the device or simulator failed; cause chained               (exit 3)
    +-- SafetyStop      a hard limit tripped below the skills; the arm is held
    +-- StaleReading    a sensor stopped delivering
    +-- GuardTripped    supervision below the tree found something wrong; the arm is held
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class GlotouchError(Exception):
    """Root of all errors of this project."""


class BadInput(GlotouchError):
    """The user's input cannot be used. The message names the file and the place."""


class ParamError(BadInput):
    """One value breaks one rule.

    Args:
        name: Dotted name of the value, e.g. ``$.container.interior_m``.
        value: What was given.
        rule: What is valid, in words.
    """

    def __init__(self, name: str, value: object, rule: str) -> None:
        super().__init__(f"{name} = {value!r}: must be {rule}")
        self.name, self.value, self.rule = name, value, rule


class UnknownName(BadInput):
    """A name that nobody registered; the message lists the valid ones and the nearest.

    Args:
        kind: What is named (``skill``, ``backend``, ``world`` ...).
        name: What was given.
        valid: The names that exist.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind, self.name, self.valid = kind, name, sorted(valid)
        near = difflib.get_close_matches(name, self.valid, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        super().__init__(f"unknown {kind} {name!r}{hint} (valid: {', '.join(self.valid) or 'none'})")


class MissionFailed(GlotouchError):
    """The mission ended without reaching its goal; carries the reason chain, root cause last."""

    def __init__(self, reasons: Iterable[str]) -> None:
        self.reasons = list(reasons)
        super().__init__(" <- ".join(self.reasons) or "no reason given")


class MotionRefused(GlotouchError):
    """A motion was not started because it cannot be made safely.

    Args:
        what: The motion that was asked for.
        why: The colliding pair, the joint limit, or the unreachable pose, with numbers.
    """

    def __init__(self, what: str, why: str) -> None:
        super().__init__(f"{what} refused: {why}")
        self.what, self.why = what, why


class BackendError(GlotouchError):
    """The device or the simulator failed. The vendor's error is chained as the cause."""


class SafetyStop(BackendError):
    """A hard limit tripped below the skill layer; the arm has been stopped and is held.

    Args:
        quantity: What was measured, with its unit in the name (``force_N``).
        value: The measured value.
        limit: The limit it passed.
        stamp_s: Robot clock at the offending sample.
    """

    def __init__(self, quantity: str, value: float, limit: float, stamp_s: float) -> None:
        super().__init__(f"safety stop at t={stamp_s:.3f} s: {quantity} {value:.3g} passed its hard limit {limit:.3g}")
        self.quantity, self.value, self.limit, self.stamp_s = quantity, value, limit, stamp_s


class StaleReading(BackendError):
    """A reading is older than its declared age limit."""

    def __init__(self, what: str, age_s: float, max_age_s: float) -> None:
        super().__init__(f"{what} is {age_s:.3f} s old; at most {max_age_s:.3f} s is allowed")
        self.what, self.age_s, self.max_age_s = what, age_s, max_age_s


class GuardTripped(BackendError):
    """Supervision below the tree found something wrong and holds the arm.

    Args:
        guard: Which guard: one of `supervision_limits.GUARDS`.
        what: What was wrong, one clause, units and the valid range in it.
        value: What was found.
        limit: What it passed.
        stamp_s: Robot clock at the offending sample.
    """

    def __init__(self, guard: str, what: str, value: float, limit: float, stamp_s: float) -> None:
        super().__init__(f"guard {guard!r} at t={stamp_s:.3f} s: {what}")
        self.guard, self.what, self.value, self.limit, self.stamp_s = guard, what, value, limit, stamp_s
