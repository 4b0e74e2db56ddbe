"""TODO door of glotouch_bt/validation."""

from glotouch_bt.validation.kill_resume import KillStudy, run_study
from glotouch_bt.validation.pause import PauseStudy, run_pauses

__all__ = ["KillStudy", "PauseStudy", "run_pauses", "run_study"]
