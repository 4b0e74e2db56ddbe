"""Scripted leaves: they have the ports, parameters and declarations of a skill, and the outcomes of a script."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from py_trees.common import Status

from glotouch_bt.mission_testing.call import Call
from glotouch_bt.mission_testing.outcomes import Decide, LeafOutcome
from glotouch_bt.mission_testing.standins import port_value
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Context, Skill, SkillFailed, SkillParams, SkillRun


@dataclass
class Stage:
    """State shared by all leaves of one run.

    Attributes:
        parts: Part of each node, by its name.
        calls: Every call, in order of start.
        begin_s: Robot time at which the mission began.
        wake: Called by each waiting leaf with the time until which it waits.
        note: Called for every call that begins or ends.
    """

    parts: Mapping[str, Part] = field(default_factory=dict)
    calls: list[Call] = field(default_factory=list)
    begin_s: float = 0.0
    wake: Callable[[float], None] = lambda until_s: None
    note: Callable[[], None] = lambda: None


@dataclass(frozen=True)
class Part:
    """Scripted part of one node.

    Attributes:
        path: The node's path in the tree.
        skill: Name of the skill.
        row: Outcomes of successive calls; the last one repeats.
    """

    path: str
    skill: str
    row: tuple[LeafOutcome | Decide, ...]

    def answer(self, call: Call) -> LeafOutcome:
        """Return the outcome of a call."""
        found = self.row[min(call.number, len(self.row) - 1)]
        return found if isinstance(found, LeafOutcome) else found(call)


STAGE: ContextVar[Stage] = ContextVar("stage")
"""The run being set up: the executive creates nodes from name, parameters and context alone."""


class _Playing(Skill):
    """Mixin over the skill's own class: its ports and declarations stay, its code never runs."""

    _call: Call

    def __init__(self, name: str, params: SkillParams, context: Context) -> None:
        Skill.__init__(self, name, params, context)
        self.stage = STAGE.get()
        self.part = self.stage.parts[name]

    initialise = Skill.initialise
    terminate = Skill.terminate

    def update(self) -> Status:
        status = Skill.update(self)
        if status is Status.FAILURE and self.reason is not None:  # the base class ended it after its longest duration
            self._call.ending, self._call.code = "FAILURE", self.reason.code
        return status

    def run(self) -> SkillRun:
        self._call = call = self._begin()
        try:
            outcome = self.part.answer(call)
            yield from self._wait(outcome)
            self._end(call, outcome)
        except GeneratorExit:
            call.ending = "PREEMPTED" if call.ending == "RUNNING" else call.ending
            raise
        except SkillFailed:
            raise
        except BaseException:
            call.ending = "RAISED"
            raise
        finally:
            call.end_s = self._now_s()
            self.stage.note()

    def _begin(self) -> Call:
        stage, path = self.stage, self.part.path
        number = sum(c.path == path for c in stage.calls)
        # A required input that was never written raises here, as in the real skill.
        given = {
            p: self.get_input(p)
            for p, info in self.INPUT_PORTS.items()
            if info.required or self.blackboard_client.exists(p)
        }
        call = Call(self.name, path, self.part.skill, number, self._now_s(), self.params, given)
        stage.calls.append(call)
        stage.note()
        return call

    def _now_s(self) -> float:
        return round(self.context.observation.now_s - self.stage.begin_s, 9)

    def _wait(self, outcome: LeafOutcome) -> SkillRun:
        if outcome.kind == "hangs":
            self._write(outcome.ports)
        begin_s = self.context.observation.now_s
        until = float("inf") if outcome.kind == "hangs" else begin_s + outcome.after_s
        longest = begin_s + self.MAX_DURATION_S
        while self.context.observation.now_s < until - 1e-9:
            self.stage.wake(min([until, longest, *(getattr(node, "deadline_s", until) for node in self._above())]))
            yield HOLD

    def _above(self) -> list[Any]:
        above, node = [], self.parent
        while node is not None:
            above.append(node)
            node = node.parent
        return above

    def _end(self, call: Call, outcome: LeafOutcome) -> None:
        if outcome.kind == "raises":
            assert outcome.error is not None
            raise outcome.error
        kind = type(self)
        written = {
            p: default_value(kind, p, outcome.kind)
            for p in self.OUTPUT_PORTS
            if p not in outcome.ports and (outcome.kind == "ok" or getattr(getattr(kind, p, None), "always", False))
        }
        call.outputs = {**written, **outcome.ports}
        self._write(call.outputs)
        if outcome.kind == "fails":
            code = outcome.code or next(iter(kind.failures()), "scripted")
            declared = kind.failures(general=True).get(code)
            raise SkillFailed(code, outcome.message or (declared.meaning if declared else "scripted"))
        call.ending = "SUCCESS"

    def _write(self, ports: Mapping[str, object]) -> None:
        for port, value in ports.items():
            self.write_port(port, value)


def promised(skill: type[Skill], port: str, outcome: str) -> object | None:
    """Return the value a skill promises for a port at this ending, or None."""
    found: object | None = getattr(getattr(skill, port, None), "on_success" if outcome == "ok" else "on_failure", None)
    return found


def default_value(skill: type[Skill], port: str, outcome: str) -> object:
    """Return the value of a port the script does not name: the promised one, or a stand-in."""
    value = promised(skill, port, outcome)
    if value is not None:
        return value
    element = getattr(getattr(skill, port, None), "element", None)
    return port_value(skill.OUTPUT_PORTS[port].data_type, element)


@lru_cache(maxsize=256)
def playing(skill: type[Skill]) -> type[Skill]:
    """Return the scripted class of a skill; its instances take their parts from the current `STAGE`."""
    return type(f"Scripted{skill.__name__}", (_Playing, skill), {"__doc__": skill.__doc__})
