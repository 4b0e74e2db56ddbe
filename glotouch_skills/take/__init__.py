"""TODO door of glotouch_skills/take."""
