"""TODO door of glotouch_skills/tool."""

from glotouch_skills.tool.tool_pickup import ToolPickup

__all__ = ["ToolPickup"]
