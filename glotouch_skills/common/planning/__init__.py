"""Plans that several skills share: stances of the open hand, closures, grasps, pushes, and the target's model."""

from glotouch_skills.common.planning.clear_planner import Clearing, ClearPlanner, FreePlace
from glotouch_skills.common.planning.finger_space import (
    Neighbour,
    finger_clearance_m,
    finger_space_m,
    gap_m,
    sampled,
)
from glotouch_skills.common.planning.grasp_holds import SHIFTS_M
from glotouch_skills.common.planning.grasp_plan import GraspPlan, plan_grasp
from glotouch_skills.common.planning.outline_grasp import outline_grasp
from glotouch_skills.common.planning.push_plan import (
    NEEDED_M,
    Push,
    PushPlanner,
    after_push,
    displaced,
    push_cost_m,
    touched_edge_m,
)
from glotouch_skills.common.planning.squeeze_motion import (
    MIN_GAP_M,
    ClosureParams,
    Squeezing,
    disturbance,
    layer_heights,
    pads_height_m,
)
from glotouch_skills.common.planning.squeeze_plan import Stance, all_sides, plan_stances, side_gaps_m
from glotouch_skills.common.planning.target import TOO_LOW, SoughtObject, find_target
from glotouch_skills.common.planning.touch_options import Option, Standing, beside, best_rates, options
