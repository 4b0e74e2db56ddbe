"""Base of the node kinds: base classes, the registry, and the protocols of the checker and the reader."""

from glotouch_bt.mission.nodes.base.analysis import (
    DataFlowAnalysis,
    ExitStates,
    PathSearch,
    Position,
    Requirement,
    Stack,
    Values,
)
from glotouch_bt.mission.nodes.base.behaviours import BuildContext, CountedLoop, Keys, MissionDecorator
from glotouch_bt.mission.nodes.base.btcpp import BtcppForm, btcpp_key, btcpp_name, btcpp_value
from glotouch_bt.mission.nodes.base.comparison import (
    ConditionSettings,
    comparison_ports,
    failure_in_words,
    holds,
    in_code,
    in_words,
)
from glotouch_bt.mission.nodes.base.kind import (
    NODES,
    NodeKind,
    NodeReader,
    NoSettings,
    kind_of,
    register,
    set_values,
    wire_setting,
)
from glotouch_bt.mission.nodes.base.loop import LoopKind, Pass
from glotouch_bt.mission.nodes.base.requirements import port_requirement
from glotouch_bt.mission.nodes.base.run_count import RunCount
from glotouch_bt.mission.nodes.base.state_sets import EMPTY, StateSets
from glotouch_bt.mission.nodes.base.state_variables import ANYTHING, UNSET, StateVariables, ValueKind
from glotouch_bt.mission.nodes.base.value_sets import ValueSets
