"""A mission, its language and its skills in other forms: drawings, BehaviorTree.CPP, JSON schema, descriptions."""

from glotouch_bt.mission.export.btcpp import MonitoredTree, as_btcpp, as_monitored
from glotouch_bt.mission.export.catalogue import describe_mission, describe_nodes, describe_skill, describe_subtree
from glotouch_bt.mission.export.drawing import as_svg, as_text
from glotouch_bt.mission.export.schema import mission_schema
