"""Motions of the held probe that several skills share: drive plans, touch the floor, return the probe."""

from glotouch_skills.common.probe.floor_contact import FEEL_FLOOR_FAILURES, FLOOR_SEARCH_M, feel_floor
from glotouch_skills.common.probe.free_corner import corner_of, corner_place, corner_walls, corners
from glotouch_skills.common.probe.plan_driver import HELD_TOLERANCE_M, Explorer, ExploringSpeeds, drive
from glotouch_skills.common.probe.return_probe import RETURN_PROBE_FAILURES, return_probe
from glotouch_skills.common.probe.tracing_params import TracingParams
