"""TODO door of glotouch_bt/mission/tree."""

from glotouch_bt.mission.tree.build import BuiltTree, build_tree
from glotouch_bt.mission.tree.decorators import ForEach, holds
from glotouch_bt.mission.tree.failure_chain import Failure, ReasonBook, sensed

__all__ = ["BuiltTree", "Failure", "ForEach", "ReasonBook", "build_tree", "holds", "sensed"]
