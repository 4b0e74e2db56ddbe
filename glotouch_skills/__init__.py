"""Skills: one file each. A skill names no backend; see `base` for what a skill is."""

from glotouch_bt.skill import Context, In, Journal, Out, Reason, Skill, SkillFailed, SkillParams, SkillRun, param

__all__ = ["Context", "In", "Journal", "Out", "Reason", "Skill", "SkillFailed", "SkillParams", "SkillRun", "param"]
