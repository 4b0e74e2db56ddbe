"""TODO door of glotouch_skills/common."""

from glotouch_skills.common.recheck import Recheck

__all__ = ["Recheck"]
