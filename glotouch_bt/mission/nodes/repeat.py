"""`repeat`: the child again after a success, a number of times or until a comparison holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from pydantic import Field

from glotouch_bt.mission.nodes.base import (
    EMPTY,
    BtcppForm,
    BuildContext,
    ConditionSettings,
    CountedLoop,
    DataFlowAnalysis,
    LoopKind,
    NodeKind,
    NodeReader,
    Pass,
    PathSearch,
    Position,
    RunCount,
    Stack,
    Values,
    comparison_ports,
    holds,
    in_words,
    wire_setting,
)
from glotouch_bt.mission.spec import Findings, Map, NodeSpec, Settings, compared


class RepeatSettings(Settings):
    """Do the child again while it succeeds, a number of times or until a condition holds (tested after each pass)."""

    times: int | None = Field(default=None, description="number of passes", ge=1, le=1_000_000)
    until: str | ConditionSettings | None = Field(default=None, description="a boolean key, or a condition")
    limit: int = Field(default=1000, description="with until: passes after which it fails", ge=1, le=1_000_000)

    @property
    def condition(self) -> ConditionSettings | None:
        """The comparison after each pass; a bare key must be true; None: it counts."""
        if isinstance(self.until, str):
            return ConditionSettings(port=self.until, equals=True)
        return self.until


class RepeatTimes(CountedLoop):
    """Run the child a number of times. FAILURE if the child fails."""

    def update(self) -> Status:
        """Count a finished pass."""
        if self.decorated.status is Status.FAILURE:
            return self.fail("child_failed", f"pass {self._passes + 1} of {self._limit} failed")
        if self.decorated.status is Status.SUCCESS:
            self._passes += 1
            return Status.SUCCESS if self._passes == self._limit else Status.RUNNING
        return self.decorated.status


class RepeatUntil(CountedLoop):
    """Run the child until a condition holds after a pass. FAILURE if the child fails or the passes are used up."""

    def __init__(self, name: str, child: Behaviour, done: Callable[[], bool], limit: int, words: str) -> None:
        super().__init__(name, child, limit)
        self._done, self._words = done, words

    def update(self) -> Status:
        """Test the condition after a finished pass."""
        if self.decorated.status is not Status.SUCCESS:
            return self.decorated.status
        self._passes += 1
        if self._done():
            return Status.SUCCESS
        if self._passes < self._limit:
            return Status.RUNNING
        passes = f"{self._passes} pass{'es' if self._passes > 1 else ''}"
        return self.fail(
            "passes_ran_out",
            f"{self._words!r} does not hold after {passes}",
            "raise its limit, or end it by another condition",
            passes=self._passes,
            limit=self._limit,
        )


class RepeatKind(LoopKind):
    """Run the child again after a success."""

    name = "repeat"
    description = "do the child again and again"
    Settings = RepeatSettings
    btcpp, sign = "Repeat", "↻"
    repeat_on = needs_settings = True

    def convert_units(self, given: Map, findings: Findings) -> tuple[Map, str]:
        """Convert the constant of `until`."""
        until = given.get("until")
        if not isinstance(until, Map):
            return given, ""
        plain, unit = compared(until, findings)
        return replace(given, entries=tuple((k, plain if v is until else v) for k, v in given.entries)), unit

    def wire(self, node: NodeSpec, given: Map, unit: str, reader: NodeReader) -> None:
        """Wire `until`; it needs either that or `times`."""
        settings = node.settings
        if not isinstance(settings, RepeatSettings):
            return
        if (settings.times is None) == (settings.until is None):
            what = "repeat needs either times or until, and not both"
            reader.findings.add(node.place, "wrong_value", what)
            return
        below = given.get("until")
        if isinstance(settings.until, ConditionSettings) and isinstance(below, Map):
            settings.until.check(below.place, reader.findings)
        path = ("until",) if isinstance(settings.until, str) else ("until", "port")
        if wire := wire_setting("until", given, reader, *path):
            node.reads = {"until": replace(wire, unit=unit)}

    def comparison(self, node: NodeSpec) -> tuple[str, ConditionSettings] | None:
        """Return that of `until`."""
        condition = node.settings.condition if isinstance(node.settings, RepeatSettings) else None
        return ("until", condition) if condition is not None and "until" in node.reads else None

    def max_passes(self, node: NodeSpec) -> int:
        """Return its `times`, or the limit of `until`."""
        settings = node.settings
        if not isinstance(settings, RepeatSettings):
            return 1
        return settings.limit if self.comparison(node) else settings.times or 1

    def max_runs(self, node: NodeSpec) -> RunCount:
        """Return the child's number, times `times` or `limit`."""
        below, settings = NodeKind.max_runs(self, node), node.settings
        return below.times(settings.times or settings.limit) if isinstance(settings, RepeatSettings) else below

    def exhausted(self, node: NodeSpec) -> bool:
        """With `until` it fails when the passes are used up."""
        return self.comparison(node) is None

    def once(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> Pass:
        """Test the condition after the child's success."""
        found = self.comparison(node)
        if found is None:
            return super().once(flow, node, entry)
        after = flow.child(node, entry)
        held, failed = flow.test(node, *found, after.success) if after.success != EMPTY else (EMPTY, EMPTY)
        return Pass(again=failed, success=held, failure=after.failure, running=after.running)

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Test the condition after the child's success."""
        found = self.comparison(node)
        if found is None or not succeeded:
            yield from super().leave(search, node, stack, succeeded, values, memory)
            return
        if search.reached(node, "until", values):
            yield Position((), values, "goal")
            return
        for held in search.verdicts(node, *found, values):
            if held:
                yield from search.leave(stack, True, values)
            else:
                yield from self.after_iteration(search, node, stack, values, memory)

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """One pass."""
        once = isinstance(node.settings, RepeatSettings) and node.settings.times == 1
        return "one pass is no repetition" if once else ""

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return the loop: counted, or until the condition holds."""
        settings = node.settings
        assert isinstance(settings, RepeatSettings)
        condition = settings.condition
        if condition is None:
            return RepeatTimes(node.name, children[0], self.max_passes(node))
        key = node.reads["until"].key
        keys = made.keys(node.name, key)
        words = settings.until if isinstance(settings.until, str) else in_words(condition)
        return RepeatUntil(node.name, children[0], lambda: holds(condition, keys.get(key)), settings.limit, words)

    def details(self, node: NodeSpec) -> list[str]:
        """Return the condition's key first."""
        own = isinstance(getattr(node.settings, "until", None), ConditionSettings)
        return [*([f"until {node.reads['until'].key}"] if own else []), *super().details(node)]

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it as `Repeat`, or as this project's `RepeatUntil`."""
        settings = node.settings
        assert isinstance(settings, RepeatSettings)
        if settings.until is None:
            return BtcppForm(self.btcpp, {"num_cycles": str(settings.times)})
        condition = settings.condition
        assert condition is not None
        ports = comparison_ports(condition, node.reads["until"].key)
        fields = {**ConditionSettings.model_fields, "limit": RepeatSettings.model_fields["limit"]}
        return BtcppForm("RepeatUntil", {**ports, "limit": str(settings.limit)}, fields)
