"""Why a mission failed: failures are noted as they happen and composed up the tree, the root cause last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite, Selector

from skills.base import Reason, Skill


@dataclass(frozen=True)
class Failure:
    """One node's failure.

    Attributes:
        node: Its name.
        text: What went wrong, one clause.
        reason: A skill's reason, if it is one.
        causes: Failures below that led to it, in order of time.
    """

    node: str
    text: str
    reason: Reason | None = None
    causes: tuple[Failure, ...] = ()

    def main(self) -> Failure | None:
        """The cause to follow: the first that ends in a skill's reason, else the first."""
        return next((c for c in self.causes if c.root().reason is not None), self.causes[0] if self.causes else None)

    def root(self) -> Failure:
        """The deepest failure along the main causes."""
        below = self.main()
        return self if below is None else below.root()

    def chain(self) -> list[Failure]:
        """Along the main causes, the root cause last."""
        below = self.main()
        return [self, *(below.chain() if below else ())]

    def __str__(self) -> str:
        return f"{self.node}: {self.text}"

    def as_dict(self) -> dict[str, object]:
        """As JSON data: {node, code, message, evidence, advice}."""
        reason = self.reason or Reason("", self.text)
        return {
            "node": self.node,
            "code": reason.code,
            "message": reason.message,
            "evidence": dict(reason.evidence),
            "advice": reason.advice,
        }


class ReasonBook:
    """Keeps the last failure of each node. A node's children are noted before the node itself (tick order).

    Composites forget the status of a child when they move on, so that a failure must be written down when it happens.
    """

    def __init__(self) -> None:
        self._last: dict[object, Failure] = {}

    def noted(self) -> dict[object, Failure]:
        """The last failure of each node that has failed, by node id."""
        return dict(self._last)

    def take_up(self, noted: Mapping[object, Failure]) -> None:
        """Begin with what another book has noted."""
        self._last = dict(noted)

    def note(self, node: Behaviour) -> None:
        """Write down why a node has just failed."""
        self._last[node.id] = self._explain(node)

    def of(self, node: Behaviour) -> Failure:
        """The last failure of a node."""
        return self._last.get(node.id) or self._explain(node)

    def _explain(self, node: Behaviour) -> Failure:
        if isinstance(node, Skill):
            reason = node.reason or Reason("failed", node.feedback_message or "gave no reason", node=node.name)
            advice = f" ({reason.advice})" if reason.advice else ""
            return Failure(node.name, f"{reason.code}: {reason.message}{advice}", reason)
        children = list(node.children)
        if isinstance(node, Selector):
            causes = tuple(self._last[c.id] for c in children if c.id in self._last)
            return Failure(node.name, f"all {len(children)} alternatives failed", None, causes)
        if isinstance(node, Composite):
            failed = next((c for c in children if c.status is Status.FAILURE), None)
            if failed is None:
                return Failure(node.name, node.feedback_message or "failed")
            step = children.index(failed) + 1
            text = f"step {step} of {len(children)}, {failed.name!r}, failed"
            return Failure(node.name, text, None, (self.of(failed),))
        failed_below = [c for c in children if c.status is Status.FAILURE]
        text = node.feedback_message or (f"{failed_below[0].name!r} failed" if failed_below else "failed")
        return Failure(node.name, text, None, tuple(self.of(c) for c in failed_below))
