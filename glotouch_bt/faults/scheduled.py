"""One fault of a plan: whether its moment has come, and whether it is over."""

from __future__ import annotations

from glotouch_bt.faults.effects import Effect
from glotouch_bt.faults.plan import FaultSpec
from glotouch_bt.faults.proof import Proof
from glotouch_bt.faults.trigger import Moment, holds, running_node


class Scheduled:
    """One fault of a plan and where it stands.

    Args:
        spec: What the plan says of it.
        effect: What it does.

    Attributes:
        proof: What it really did.
        active: It is under way.
        spent: It will not come again.
    """

    def __init__(self, spec: FaultSpec, effect: Effect) -> None:
        self.spec, self.effect = spec, effect
        self.proof = Proof(spec, effect.acts)
        self.active = False
        self.spent = False
        self._node: str | None = None
        self._until_s: float | None = None
        self._until_cycle: int | None = None
        self._next_s = float("-inf")

    def try_begin(self, moment: Moment) -> bool:
        """Begin if its moment has come."""
        when = self.spec.when
        if moment.now_s < self._next_s - 1e-9 or not holds(when, moment):
            return False
        self._node = running_node(when, moment)
        if when.node is not None and self._node is None:
            return False
        lasting, now_s = self.spec.lasting, moment.now_s
        self._until_s = None if lasting.duration_s is None else now_s + lasting.duration_s
        self._until_cycle = None if lasting.cycles is None else moment.cycles + lasting.cycles
        self._next_s = now_s + self.spec.repeat.every_s
        self.effect.scene.sensed = moment.sensed
        self.effect.begin()
        self.active = True
        self.proof.begun_s.append(now_s)
        self.proof.nodes.extend([self._node] if self._node else [p for p in moment.running if _is_leaf(p, moment)])
        if self.effect.acts.times:
            self.proof.changed(now_s)
        return True

    def try_end(self, moment: Moment) -> bool:
        """End if its time is over."""
        over = (
            (self._until_s is not None and moment.now_s >= self._until_s - 1e-9)
            or (self._until_cycle is not None and moment.cycles >= self._until_cycle)
            or (self.spec.lasting.until == "node" and self._node not in moment.running)
        )
        if over:
            self.active = False
            self.effect.end()
            self.proof.ended_s.append(moment.now_s)
            self.spent = len(self.proof.begun_s) >= self.spec.repeat.times
        return over


def _is_leaf(path: str, moment: Moment) -> bool:
    return not any(other.startswith(path + "/") for other in moment.running)
