"""Node kinds, one file each: settings, reading, building, transitions for the checker, drawing, BehaviorTree.CPP form.

To add one: write its class in a new file here, and register it below.
"""

from glotouch_bt.mission.nodes.base import (
    ANYTHING,
    EMPTY,
    NODES,
    UNSET,
    BuildContext,
    ConditionSettings,
    ExitStates,
    MissionDecorator,
    NodeKind,
    NoSettings,
    Position,
    Requirement,
    Stack,
    ValueKind,
    Values,
    btcpp_value,
    holds,
    kind_of,
    register,
)
from glotouch_bt.mission.nodes.condition import ConditionKind
from glotouch_bt.mission.nodes.fail import FailKind
from glotouch_bt.mission.nodes.for_each import ForEachKind, ForEachSettings
from glotouch_bt.mission.nodes.invert import InvertKind
from glotouch_bt.mission.nodes.parallel import ParallelKind, ParallelSettings
from glotouch_bt.mission.nodes.repeat import RepeatKind, RepeatSettings
from glotouch_bt.mission.nodes.retry import RetryKind, RetrySettings
from glotouch_bt.mission.nodes.selector import SelectorKind
from glotouch_bt.mission.nodes.sequence import SequenceKind
from glotouch_bt.mission.nodes.skill import SkillKind
from glotouch_bt.mission.nodes.subtree import SubtreeKind, SubtreeSettings
from glotouch_bt.mission.nodes.succeed import SucceedKind
from glotouch_bt.mission.nodes.timeout import TimeoutKind, TimeoutSettings

register(SequenceKind())
register(SelectorKind())
register(ParallelKind())
register(RetryKind())
register(TimeoutKind())
register(RepeatKind())
register(ForEachKind())
register(InvertKind())
register(SucceedKind())
register(FailKind())
register(ConditionKind())
register(SubtreeKind())
register(SkillKind(), named=False)
