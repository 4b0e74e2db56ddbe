"""The schedule of one fault of a plan: when it starts and when it ends."""

from __future__ import annotations

from typing import Any

from glotouch_bt.faults.effects import Effect
from glotouch_bt.faults.plan import FaultSpec
from glotouch_bt.faults.proof import Proof
from glotouch_bt.faults.trigger import TriggerState, condition_holds, running_node


class ScheduledFault:
    """One fault of a plan and its state.

    Args:
        spec: The requested fault.
        effect: Its effect.

    Attributes:
        proof: What it did so far.
        active: It is active now.
        spent: It will not start again.
    """

    def __init__(self, spec: FaultSpec, effect: Effect[Any]) -> None:
        self.spec, self.effect = spec, effect
        self.proof = Proof(spec, effect.actions)
        self.active = False
        self.spent = False
        self._node: str | None = None
        self._until_s: float | None = None
        self._until_cycle: int | None = None
        self._next_s = float("-inf")

    def try_begin(self, moment: TriggerState) -> bool:
        """Start the fault if its trigger holds; return True if it started."""
        when = self.spec.when
        if moment.now_s < self._next_s - 1e-9 or not condition_holds(when, moment):
            return False
        self._node = running_node(when, moment)
        if when.node is not None and self._node is None:
            return False
        duration, now_s = self.spec.duration, moment.now_s
        self._until_s = None if duration.duration_s is None else now_s + duration.duration_s
        self._until_cycle = None if duration.cycles is None else moment.cycles + duration.cycles
        self._next_s = now_s + self.spec.repeat.every_s
        self.effect.context.sensed = moment.sensed
        self.effect.begin()
        self.active = True
        self.proof.begun_s.append(now_s)
        self.proof.nodes.extend([self._node] if self._node else [p for p in moment.running if _is_leaf(p, moment)])
        if self.effect.actions.count:
            self.proof.changed(now_s)
        return True

    def try_end(self, moment: TriggerState) -> bool:
        """End the fault if its time is over; return True if it ended."""
        over = (
            (self._until_s is not None and moment.now_s >= self._until_s - 1e-9)
            or (self._until_cycle is not None and moment.cycles >= self._until_cycle)
            or (self.spec.duration.until == "node" and self._node not in moment.running)
        )
        if over:
            self.active = False
            self.effect.end()
            self.proof.ended_s.append(moment.now_s)
            self.spent = len(self.proof.begun_s) >= self.spec.repeat.times
        return over


def _is_leaf(path: str, moment: TriggerState) -> bool:
    return not any(other.startswith(path + "/") for other in moment.running)
