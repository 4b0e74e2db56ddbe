"""TODO door of glotouch_bt/mission/spec."""

from glotouch_bt.mission.spec.findings import Finding, Findings, MissionFaults
from glotouch_bt.mission.spec.node import (
    KINDS,
    ConditionSettings,
    ForEachSettings,
    Kind,
    NodeSpec,
    ParallelSettings,
    Plain,
    RepeatSettings,
    RetrySettings,
    Settings,
    SubtreeSettings,
    TimeoutSettings,
    Wire,
    number_names,
)
from glotouch_bt.mission.spec.quantities import compared, measured
from glotouch_bt.mission.spec.source import Map, Node, Place, Scalar, Seq, plain
from glotouch_bt.mission.spec.units import UNITS, base_of, convert, split_quantity, unit_of_name, units_for

__all__ = [
    "KINDS",
    "UNITS",
    "ConditionSettings",
    "Finding",
    "Findings",
    "ForEachSettings",
    "Kind",
    "Map",
    "MissionFaults",
    "Node",
    "NodeSpec",
    "ParallelSettings",
    "Place",
    "Plain",
    "RepeatSettings",
    "RetrySettings",
    "Scalar",
    "Seq",
    "Settings",
    "SubtreeSettings",
    "TimeoutSettings",
    "Wire",
    "base_of",
    "compared",
    "convert",
    "measured",
    "number_names",
    "plain",
    "split_quantity",
    "unit_of_name",
    "units_for",
]
