"""From a checked tree to py_trees nodes, and from their failures to the chain that explains a failed mission."""

from glotouch_bt.mission.tree.build import BuiltTree, build_tree
from glotouch_bt.mission.tree.failure_chain import NodeFailure, ReasonBook, sensed
from glotouch_bt.mission.tree.running_skill import RunningSkill
