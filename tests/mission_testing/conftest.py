"""Three small skills and missions of them: the testing kit is tested without the house's own skills."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.mission.load import Mission, load_mission
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param


@dataclass(frozen=True)
class Item:
    weight: float
    name: str = "x"

    def __post_init__(self) -> None:
        if self.weight <= 0:
            raise ValueError("weight must be positive")


class FindParams(SkillParams):
    how_many: int = param("how many", default=3, ge=0, le=9)


class Find(Skill):
    """Find items."""

    Params = FindParams
    NOTHING = Failure("nothing", "nothing is there")
    BLOCKED = Failure("blocked", "the way is blocked")
    items = Out(tuple, "what was found", element=Item)
    found = Out(int, "how many")
    complete = Out(bool, "all of them", always=True)

    def run(self) -> SkillRun:
        yield HOLD


class Use(Skill):
    """Use one item."""

    BROKEN = Failure("broken", "it broke")
    item = In(Item, "what to use")
    all_items = In(tuple, "all", key="items", required=False)
    mark = Out(float, "how well it went")

    def run(self) -> SkillRun:
        yield HOLD


class Rest(Skill):
    """Do nothing, for real: three control periods."""

    def run(self) -> SkillRun:
        for _ in range(3):
            yield HOLD


SKILLS: dict[str, type[Skill]] = {"find": Find, "use": Use, "rest": Rest}

EACH = """
  - retry: {attempts: 2, do: find}
  - for_each: {items: items, item: item, on_failure: continue, collect: {mark: marks}, do: use}
  - condition: {name: enough, port: found, at_least: 2}
"""


@pytest.fixture
def mission(tmp_path: Path) -> Callable[[str], Mission]:
    def make(tree: str = EACH, **settings: Any) -> Mission:
        path = tmp_path / "m.yaml"
        path.write_text(f"mission: m\nworld: container_five\ntree:{tree}")
        return load_mission(path, settings, skills=SKILLS)

    return make


@pytest.fixture
def item() -> type[Item]:
    return Item
