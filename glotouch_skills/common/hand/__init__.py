"""Motions of the hand and the jaws that several skills share: rise, glide, close, release, weigh."""

from glotouch_skills.common.hand.clearance_rules import keeping_clear_of, may_touch, neighbours
from glotouch_skills.common.hand.compliant_close import close_compliantly, release
from glotouch_skills.common.hand.descent import descend, descent_speed_steps, seconds_at, unfelt_speed_steps
from glotouch_skills.common.hand.fingertips import fingertips_K_m, inner_edges, rise_from_met
from glotouch_skills.common.hand.hand import CLEARANCE_M, NoSpace, glide, require_clear
from glotouch_skills.common.hand.line_guard import (
    DOWN_B,
    UP_B,
    Pressed,
    StraightGuard,
    Strayed,
    describe_stop,
    straight_guard,
)
from glotouch_skills.common.hand.lowering import RELEASE_HEIGHT_M, let_jaws_rest, lower
from glotouch_skills.common.hand.retract import CAUGHT_N, RISE_M_S, rise_clear
from glotouch_skills.common.hand.wait_for import REQUEST_FAILED, WRIST_STATES, finish, set_payload_and_tare
from glotouch_skills.common.hand.weighing import (
    GRAVITY_M_S2,
    MIN_GRIP_M,
    MIN_GRIP_N,
    STAND_S,
    Hold,
    feel_hold,
    weigh,
    weigh_N,
)
