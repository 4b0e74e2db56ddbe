"""The 3D scene of a run: its solids, which every view draws, and the player of the report."""

from glotouch_bt.report.scene import shapes
from glotouch_bt.report.scene.played import scene_data, scene_json, script
from glotouch_bt.report.scene.shapes import STATE_COLOURS
