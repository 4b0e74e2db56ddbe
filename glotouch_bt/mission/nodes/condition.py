"""`condition`: a port compared with a constant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from glotouch_bt.mission.nodes.base import (
    BtcppForm,
    BuildContext,
    ConditionSettings,
    DataFlowAnalysis,
    ExitStates,
    Keys,
    NodeKind,
    NodeReader,
    PathSearch,
    Position,
    Stack,
    Values,
    btcpp_name,
    comparison_ports,
    failure_in_words,
    holds,
    in_code,
    in_words,
    wire_setting,
)
from glotouch_bt.mission.spec import Findings, Map, NodeSpec, compared
from glotouch_bt.skill import Reason


class PortCondition(Behaviour):
    """SUCCESS if a comparison holds, else FAILURE; never RUNNING."""

    def __init__(self, name: str, keys: Keys, key: str, settings: ConditionSettings) -> None:
        super().__init__(name)
        self.reason: Reason | None = None
        self._keys, self._key, self._settings = keys, key, settings

    def update(self) -> Status:
        """Compare."""
        value = self._keys.get(self._key)
        if holds(self._settings, value):
            self.feedback_message, self.reason = "", None
            return Status.SUCCESS
        self.feedback_message = failure_in_words(self._settings, value)
        found = value if isinstance(value, (int, float, str)) else "not set" if value is None else "another value"
        evidence = {"wanted": in_words(self._settings), "found": found}
        self.reason = Reason("condition_false", self.feedback_message, evidence, node=self.name)
        return Status.FAILURE


class ConditionKind(NodeKind):
    """Compare a port with a constant, at once."""

    name = "condition"
    description = "test a port"
    Settings = ConditionSettings
    children = "none"
    sign, fill = "◇", "#fdf3d8"

    def convert_units(self, given: Map, findings: Findings) -> tuple[Map, str]:
        """Convert the constant."""
        return compared(given, findings)

    def default_name(self, node: NodeSpec) -> str:
        """Return the port with a question mark."""
        return f"{node.settings.port}?" if isinstance(node.settings, ConditionSettings) else self.name

    def wire(self, node: NodeSpec, given: Map, unit: str, reader: NodeReader) -> None:
        """Wire the port."""
        if isinstance(node.settings, ConditionSettings):
            node.settings.check(node.place, reader.findings)
        if wire := wire_setting("port", given, reader):
            node.reads = {"port": replace(wire, unit=unit)}

    def comparison(self, node: NodeSpec) -> tuple[str, ConditionSettings] | None:
        """Return its settings."""
        settings = node.settings
        return ("port", settings) if isinstance(settings, ConditionSettings) and "port" in node.reads else None

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Split the states by the result of the comparison."""
        found = self.comparison(node)
        return flow.unknown(entry) if found is None else ExitStates(*flow.test(node, *found, entry))

    def step(
        self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values, memory: Any
    ) -> Iterator[tuple[str, Position]]:
        """Yield both results, as far as they are possible."""
        found = self.comparison(node)
        for held in search.verdicts(node, *found, values) if found else ():
            for there in search.leave(stack, held, values):
                yield f"{node.name} {'holds' if held else 'does not hold'}", there

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return the comparison."""
        assert isinstance(node.settings, ConditionSettings)
        key = node.reads["port"].key
        return PortCondition(node.name, made.keys(node.name, key), key, node.settings)

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it as a script, or as this project's `PortCondition` if no script can express it."""
        settings, key = node.settings, node.reads["port"].key
        assert isinstance(settings, ConditionSettings)
        code = in_code(settings, btcpp_name(key))
        if code is not None:
            return BtcppForm("ScriptCondition", {"code": code})
        return BtcppForm("PortCondition", comparison_ports(settings, key), ConditionSettings.model_fields)
