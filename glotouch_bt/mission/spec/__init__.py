"""TODO door of glotouch_bt/mission/spec."""

from glotouch_bt.mission.spec.findings import Finding, Findings, MissionFaults
from glotouch_bt.mission.spec.node import NodeSpec, Settings, Wire, number_names
from glotouch_bt.mission.spec.quantities import compared, measured
from glotouch_bt.mission.spec.source import Map, Node, Place, Scalar, Seq, plain
from glotouch_bt.mission.spec.units import UNITS, base_of, convert, split_quantity, unit_of_name, units_for

__all__ = [
    "UNITS",
    "Finding",
    "Findings",
    "Map",
    "MissionFaults",
    "Node",
    "NodeSpec",
    "Place",
    "Scalar",
    "Seq",
    "Settings",
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
