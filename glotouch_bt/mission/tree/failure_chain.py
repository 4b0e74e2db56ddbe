"""The chain of failures that explains a failed mission, from the root of the tree down to the root cause."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from glotouch_bt.robot import Observation
from glotouch_bt.skill import Reason, Skill


@dataclass(frozen=True)
class NodeFailure:
    """One node's failure.

    Attributes:
        node: Its name.
        text: What went wrong, in one clause.
        reason: Its code, numbers and advice.
        causes: Failures below that led to it, in order of time.
        skill: True for a skill's failure, and for one from outside the tree.
        sensed: What the robot sensed when a skill failed (see `sensed`).
    """

    node: str
    text: str
    reason: Reason
    causes: tuple[NodeFailure, ...] = ()
    skill: bool = True
    sensed: Mapping[str, float] = field(default_factory=dict)

    def main(self) -> NodeFailure | None:
        """Return the cause to follow: the first one that ends in a skill's failure, else the first one."""
        return next((c for c in self.causes if c.root().skill), self.causes[0] if self.causes else None)

    def root(self) -> NodeFailure:
        """Return the deepest failure along the main causes."""
        below = self.main()
        return self if below is None else below.root()

    def chain(self) -> list[NodeFailure]:
        """Return this failure and its main causes, the root cause last."""
        below = self.main()
        return [self, *(below.chain() if below else ())]

    def __str__(self) -> str:
        return f"{self.node}: {self.text}"

    def as_dict(self) -> dict[str, object]:
        """Return it as JSON data: {node, code, message, evidence, advice, sensed, others}.

        `others`: the causes besides the one that the chain continues with.
        """
        main = self.main()
        return {
            "node": self.node,
            "code": self.reason.code,
            "message": self.reason.message,
            "evidence": dict(self.reason.evidence),
            "advice": self.reason.advice,
            "sensed": dict(self.sensed),
            "others": [str(c.root()) for c in self.causes if c is not main],
        }


class ReasonBook:
    """The last failure of each node. A node's children must be noted before the node itself (tick order).

    Composites forget the status of a child when they move on, so each failure must be noted when it happens.

    Attributes:
        last: The last failure of each node that has failed, by node id.
    """

    def __init__(self) -> None:
        self.last: dict[object, NodeFailure] = {}

    def note(self, node: Behaviour, sensed: Mapping[str, float] | None = None) -> None:
        """Note why a node has just failed, and what the robot sensed then."""
        failure = self._explain(node)
        self.last[node.id] = replace(failure, sensed=sensed) if sensed and failure.skill else failure

    def of(self, node: Behaviour) -> NodeFailure:
        """Return the last failure of a node."""
        return self.last.get(node.id) or self._explain(node)

    def _explain(self, node: Behaviour) -> NodeFailure:
        if isinstance(node, Skill):
            reason = node.reason or Reason("failed", node.feedback_message or "gave no reason", node=node.name)
            advice = f" ({reason.advice})" if reason.advice else ""
            return NodeFailure(node.name, f"{reason.code}: {reason.message}{advice}", reason)
        causes = self._causes(node)
        own: Reason | None = getattr(node, "reason", None)
        if own is None:
            code, text = _words(node, causes)
            own = Reason(code, text, node=node.name)
        return NodeFailure(node.name, own.message, own, causes, skill=False)

    def _causes(self, node: Behaviour) -> tuple[NodeFailure, ...]:
        """Return what failed below a node: of a selector every branch, of others the last failure."""
        if isinstance(node, Selector):
            return tuple(self.last[c.id] for c in node.children if c.id in self.last)
        failed = [c for c in node.children if c.status is Status.FAILURE]
        return tuple(self.of(c) for c in (failed[:1] if isinstance(node, Sequence) else failed))


def _words(node: Behaviour, causes: tuple[NodeFailure, ...]) -> tuple[str, str]:
    """Return code and clause of a node that failed because of its children."""
    below = f"{causes[0].node!r} failed" if causes else node.feedback_message or "failed"
    if isinstance(node, Selector):
        return "alternatives_failed", f"all {len(node.children)} alternatives failed"
    if isinstance(node, Sequence) and causes:
        step = next(i for i, c in enumerate(node.children, start=1) if c.status is Status.FAILURE)
        return "step_failed", f"step {step} of {len(node.children)}, {below.replace(' failed', ', failed')}"
    return "child_failed" if causes else "failed", node.feedback_message or below


def sensed(observation: Observation) -> dict[str, float]:
    """Return what the robot senses at a failure: {stamp_s, force_N, torque_Nm, aperture_m, x_B_m, y_B_m, z_B_m}.

    All of the newest sample. Force and torque are norms of the wrist's wrench; x, y, z is P in B.
    """
    wrench, p = observation.wrench_S[-1], observation.position_B_P[-1]
    return {
        "stamp_s": round(observation.now_s, 6),
        "force_N": round(float(math.hypot(*wrench[:3])), 4),
        "torque_Nm": round(float(math.hypot(*wrench[3:])), 5),
        "aperture_m": round(observation.gripper.aperture_m, 7),
        **{f"{axis}_B_m": round(float(v), 6) for axis, v in zip("xyz", p, strict=True)},
    }
