"""Values that reading and checking missions share: nodes, findings, units, source positions. No reading, no rules."""

from glotouch_bt.mission.spec.finding_kinds import FINDING_KINDS, describe_findings
from glotouch_bt.mission.spec.findings import Finding, Findings, MissionFaults
from glotouch_bt.mission.spec.node import NodeSpec, Settings, Wire, number_names
from glotouch_bt.mission.spec.quantities import compared, measured
from glotouch_bt.mission.spec.source import Map, Node, Place, Scalar, Seq, plain, walk
from glotouch_bt.mission.spec.units import (
    SMALLER_UNITS,
    UNITS,
    base_of,
    convert,
    split_quantity,
    unit_of_name,
    units_for,
)
