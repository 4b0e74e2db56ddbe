"""TODO door of glotouch_skills/recognise."""

from glotouch_skills.recognise.match import load_target

__all__ = ["load_target"]
