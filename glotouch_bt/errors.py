"""All errors of the project. They have one root, carry data, and say what is valid.

GlotouchError
+-- BadInput            the user's file, option or mesh is wrong; nothing moved     (exit 2)
|   +-- ParamError      one named value breaks one stated rule
|   +-- UnknownName     a name that is not registered; lists the valid ones
+-- MissionFailed       the mission ran and did not reach its goal                  (exit 1)
+-- MotionRefused       a motion would collide or leave the joint limits; not started
+-- BackendError        the device or simulator failed; cause chained               (exit 3)
    +-- SafetyStop      a hard limit tripped below the skills; the arm is held
    +-- StaleReading    a sensor stopped delivering
    +-- GuardTripped    a guard below the tree tripped; the arm is held
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class GlotouchError(Exception):
    """Root of all errors of this project."""


class BadInput(GlotouchError):
    """The user's input is not usable. The message names the file and the place."""


class ParamError(BadInput):
    """One value breaks one rule.

    Args:
        name: Dotted name of the value, e.g. ``$.container.interior_m``.
        value: The given value.
        rule: What is valid, in words.
    """

    def __init__(self, name: str, value: object, rule: str) -> None:
        super().__init__(f"{name} = {value!r}: must be {rule}")
        self.name, self.value, self.rule = name, value, rule


class UnknownName(BadInput):
    """A name that is not registered; the message lists the valid ones and the nearest.

    Args:
        kind: Kind of name (``skill``, ``backend``, ``world`` ...).
        name: The given name.
        valid: The names that exist.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind, self.name, self.valid = kind, name, sorted(valid)
        near = difflib.get_close_matches(name, self.valid, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        super().__init__(f"unknown {kind} {name!r}{hint} (valid: {', '.join(self.valid) or 'none'})")


class MissionFailed(GlotouchError):
    """The mission ended without reaching its goal; `reasons` is the chain, root cause last."""

    def __init__(self, reasons: Iterable[str]) -> None:
        self.reasons = list(reasons)
        super().__init__(" <- ".join(self.reasons) or "no reason given")


class MotionRefused(GlotouchError):
    """A motion was not started because it is not safe.

    Args:
        what: The requested motion.
        why: The colliding pair, the joint limit, or the unreachable pose, with numbers.
    """

    def __init__(self, what: str, why: str) -> None:
        super().__init__(f"{what} refused: {why}")
        self.what, self.why = what, why


class BackendError(GlotouchError):
    """The device or the simulator failed. The vendor's error is chained as the cause."""


class SafetyStop(BackendError):
    """A hard limit tripped below the skills; the arm is stopped and held.

    Args:
        quantity: The measured quantity, with its unit in the name (``force_N``).
        value: The measured value.
        limit: The limit it passed.
        stamp_s: Robot clock at the offending sample.
    """

    def __init__(self, quantity: str, value: float, limit: float, stamp_s: float) -> None:
        super().__init__(f"safety stop at t={stamp_s:.3f} s: {quantity} {value:.3g} passed its hard limit {limit:.3g}")
        self.quantity, self.value, self.limit, self.stamp_s = quantity, value, limit, stamp_s


class StaleReading(BackendError):
    """A reading is older than allowed."""

    def __init__(self, what: str, age_s: float, max_age_s: float) -> None:
        super().__init__(f"{what} is {age_s:.3f} s old; at most {max_age_s:.3f} s are allowed")
        self.what, self.age_s, self.max_age_s = what, age_s, max_age_s


class GuardTripped(BackendError):
    """A guard below the tree tripped and holds the arm.

    Args:
        guard: Its name; docs/explanation/supervision.md lists them.
        what: One clause with units and the valid range.
        value: The offending value.
        limit: What it passed.
        stamp_s: Robot clock at the offending sample.
    """

    def __init__(self, guard: str, what: str, value: float, limit: float, stamp_s: float) -> None:
        super().__init__(f"guard {guard!r} at t={stamp_s:.3f} s: {what}")
        self.guard, self.what, self.value, self.limit, self.stamp_s = guard, what, value, limit, stamp_s
