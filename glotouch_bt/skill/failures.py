"""Failures of skills: the declared failures, the reason that a run gives, and the failures that any skill can have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from glotouch_bt.robot import GlotouchError


@dataclass(frozen=True)
class Reason:
    """Reason of a node's failure.

    Attributes:
        code: Short stable word, e.g. ``search_exhausted``.
        message: One sentence for a person, with numbers.
        evidence: Numbers against their limits.
        advice: What to try.
        node: Name of the tree node.
    """

    code: str
    message: str
    evidence: Mapping[str, float | int | str | bool] = field(default_factory=dict)
    advice: str = ""
    node: str = ""


class SkillFailed(GlotouchError):
    """Raised inside `run` to end the skill with FAILURE."""

    def __init__(self, code: str, message: str, *, advice: str = "", **evidence: float | int | str | bool) -> None:
        super().__init__(message)
        self.reason = Reason(code, message, evidence, advice)


@dataclass(frozen=True)
class Failure:
    """One way in which a skill can fail. Declare it once, as a class attribute of the skill or beside a shared motion.

    Raise it by calling it: ``raise self.LOST(f"{weight_N:.2f} N in hand", weight_N=weight_N)``.

    Attributes:
        code: Short stable word by which missions and tests name it.
        meaning: What it says about the world, in a few words.
        advice: What to try.
    """

    code: str
    meaning: str
    advice: str = ""

    def __call__(self, message: str, *, advice: str = "", **evidence: float | int | str | bool) -> SkillFailed:
        """Return the exception to raise: one sentence with numbers, other advice if given, and the evidence."""
        return SkillFailed(self.code, message, advice=advice or self.advice, **evidence)

    def with_meaning(self, meaning: str) -> Failure:
        """Return the same failure as it reads for one skill."""
        return replace(self, meaning=meaning)


MOTION_REFUSED = Failure("motion_refused", "the way is not clear", advice="move the target or clear the way")
"""Given for every `MotionRefused` that a skill does not handle."""
NOT_AT_REST = Failure(
    "not_at_rest",
    "the arm still moves after the previous skill was preempted",
    advice="something pushes the arm, or the servo does not settle",
)
SKILL_TIMEOUT = Failure(
    "skill_timeout",
    "the skill took longer than its class allows",
    advice="the skill hangs, or its task is larger than expected",
)
GENERAL_FAILURES = (NOT_AT_REST, SKILL_TIMEOUT)
"""Failures of the base class, which every skill can have."""


class UndeclaredFailure(UserWarning):
    """A skill failed with a code that it does not declare."""
