"""Node kinds, one file each or each family: settings, reading, building, transitions for the checker, drawing, BT.CPP.

To add one: write its class in a new file here, and register it below.
"""

from glotouch_bt.mission.nodes.base import (
    ANYTHING,
    EMPTY,
    NODES,
    UNSET,
    BtcppForm,
    BuildContext,
    ConditionSettings,
    ExitStates,
    MissionDecorator,
    NodeKind,
    NoSettings,
    Position,
    Requirement,
    Stack,
    StateSets,
    StateVariables,
    ValueKind,
    Values,
    ValueSets,
    btcpp_name,
    btcpp_value,
    holds,
    kind_of,
    register,
)
from glotouch_bt.mission.nodes.condition import ConditionKind
from glotouch_bt.mission.nodes.for_each import ForEach, ForEachKind, ForEachSettings
from glotouch_bt.mission.nodes.ordered import SelectorKind, SequenceKind
from glotouch_bt.mission.nodes.outcomes import FailKind, InvertKind, SucceedKind
from glotouch_bt.mission.nodes.parallel import ParallelKind, ParallelSettings
from glotouch_bt.mission.nodes.repeat import RepeatKind, RepeatSettings
from glotouch_bt.mission.nodes.retry import RetryKind, RetrySettings
from glotouch_bt.mission.nodes.skill import SkillKind
from glotouch_bt.mission.nodes.subtree import SubtreeKind, SubtreeSettings
from glotouch_bt.mission.nodes.timeout import TimeoutKind, TimeoutSettings

_kind: NodeKind
for _kind in (SequenceKind(), SelectorKind(), ParallelKind(), RetryKind(), TimeoutKind(), RepeatKind(), ForEachKind()):
    register(_kind)
for _kind in (InvertKind(), SucceedKind(), FailKind(), ConditionKind(), SubtreeKind()):
    register(_kind)
register(SkillKind(), named=False)
