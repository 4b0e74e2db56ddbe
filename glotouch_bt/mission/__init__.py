"""Missions: YAML to a checked tree, one tick a control period, a result with reasons."""
