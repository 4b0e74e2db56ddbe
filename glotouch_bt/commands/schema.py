"""`glotouch schema`: the JSON Schema of mission files."""

from __future__ import annotations

from glotouch_bt.commands.shared import guarded, print_json


@guarded
def schema() -> None:
    """Print the JSON Schema of mission files, for editors."""
    from glotouch_bt.mission.export import mission_schema
    from glotouch_bt.mission.read import SkillRegistry

    print_json(mission_schema(SkillRegistry()))
