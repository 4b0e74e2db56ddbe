"""Base of the node kinds: base classes, the registry, and the protocols of the checker and the reader."""

from glotouch_bt.mission.nodes.base.analysis import (
    ANYTHING,
    EMPTY,
    UNSET,
    DataFlowAnalysis,
    ExitStates,
    PathSearch,
    Position,
    Requirement,
    Stack,
    ValueKind,
    Values,
    VariableTable,
)
from glotouch_bt.mission.nodes.base.behaviours import BuildContext, CountedLoop, Keys, MissionDecorator
from glotouch_bt.mission.nodes.base.comparison import ConditionSettings, holds, in_code, in_words
from glotouch_bt.mission.nodes.base.composite import CompositeKind
from glotouch_bt.mission.nodes.base.kind import (
    NODES,
    BtcppForm,
    NodeKind,
    NodeReader,
    NoSettings,
    btcpp_key,
    btcpp_name,
    btcpp_value,
    kind_of,
    register,
    set_values,
    wire_setting,
)
from glotouch_bt.mission.nodes.base.loop import LoopKind, Pass
from glotouch_bt.mission.nodes.base.requirements import comparison_requirement, port_requirement
from glotouch_bt.mission.nodes.base.run_count import RunCount
