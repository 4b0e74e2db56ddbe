"""The state of a mission at any time, from its record: pure values for every view of it. Knows no page and no robot."""

from glotouch_bt.report.state.model import GrowingRows, RunModel
from glotouch_bt.report.state.parse import felt_points_P, true_bodies
from glotouch_bt.report.state.player import Player
from glotouch_bt.report.state.setup import RunSetup, planned_nodes, read_setup
from glotouch_bt.report.state.tree import TreeNode, TreeRow, tree_of, tree_order, tree_rows
from glotouch_bt.report.state.values import (
    CandidateOutline,
    FeltPatch,
    FittedTarget,
    GhostObject,
    LogLine,
    OutlineState,
    PlannedGrasp,
    SceneState,
    Share,
)
