"""TODO door of glotouch_bt/commissioning."""

from glotouch_bt.commissioning.doctor import Finding, nearly_empty, visit
from glotouch_bt.commissioning.link import LinkStudy, run_study

__all__ = ["Finding", "LinkStudy", "nearly_empty", "run_study", "visit"]
