"""The state of a mission at any time, from its record: pure values for every view of it. Knows no page and no robot."""

from glotouch_bt.view.state.model import NO_WINDOW_M, RunModel
from glotouch_bt.view.state.parse import felt_points_P, true_bodies
from glotouch_bt.view.state.player import Player
from glotouch_bt.view.state.setup import RunSetup, planned_nodes, read_setup
from glotouch_bt.view.state.tree import TreeRow, tree_rows
from glotouch_bt.view.state.values import (
    CandidateOutline,
    FeltPatch,
    GhostObject,
    LogLine,
    OutlineState,
    PlannedGrasp,
    SceneState,
    Share,
    TouchPoint,
)
