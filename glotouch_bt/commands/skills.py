"""`glotouch skills`: the installed skills."""

from __future__ import annotations

from typing import Annotated

import typer

from glotouch_bt.commands.shared import Json, guarded, print_json


@guarded
def skills(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one skill")] = None, json_: Json = False
) -> None:
    """List the installed skills, or describe one.

    The description gives parameters with units and ranges, ports, states and failures.
    """
    from glotouch_bt.commands.terminal import print_skill, print_skills
    from glotouch_bt.mission.export import describe_skill
    from glotouch_bt.mission.read import SkillRegistry

    installed = SkillRegistry()
    described = [describe_skill(n, installed[n]) for n in ([name] if name else installed)]
    if json_:
        print_json(described[0] if name else described)
    elif name:
        print_skill(described[0])
    else:
        print_skills(described)
