"""Missions: YAML to a checked tree, one tick a control period, a result with reasons."""

from glotouch_bt.mission.feasible import check_feasible, missing_parts
from glotouch_bt.mission.load import Mission, load_mission, node_paths, split_settings
