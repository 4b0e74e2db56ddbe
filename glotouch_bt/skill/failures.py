"""Why a skill fails: the reason it gives, and the failures any skill can have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from glotouch_bt.robot import GlotouchError

GENERAL_FAILURES: Mapping[str, str] = MappingProxyType(
    {
        "not_at_rest": "the arm still moves after the skill before was broken off",
        "skill_timeout": "it took longer than its class allows",
    }
)
"""Failures that the base class gives, so that any skill can."""


@dataclass(frozen=True)
class Reason:
    """Why a node failed.

    Attributes:
        code: Short stable word, e.g. ``search_exhausted``.
        message: One sentence for a person, with numbers.
        evidence: Numbers against their limits.
        advice: What to try.
        node: Name of the tree node.
    """

    code: str
    message: str
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)
    advice: str = ""
    node: str = ""


class SkillFailed(GlotouchError):
    """Raised inside `run` to end the skill with FAILURE."""

    def __init__(self, code: str, message: str, *, advice: str = "", **evidence: float | int | str) -> None:
        super().__init__(message)
        self.reason = Reason(code, message, evidence, advice)


class UndeclaredFailure(UserWarning):
    """A skill failed with a code that its `FAILURES` do not name."""
