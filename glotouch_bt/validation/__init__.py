"""Campaigns on the executive itself: faults, kills, pauses, malformed documents, seeded mistakes."""

from glotouch_bt.validation.kill_resume import KillStudy, run_study
from glotouch_bt.validation.pause import PauseStudy, run_pauses
