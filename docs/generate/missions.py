"""The page on mission files: their keys, parameters, trees and units, and the shipped missions and subtrees."""

from __future__ import annotations

from typing import Any

from markdown_text import code, codes, fields, table

from glotouch_bt.mission.export import describe_mission, describe_subtree, mission_schema
from glotouch_bt.mission.read import Declaration, SkillRegistry, shipped
from glotouch_bt.mission.spec import UNITS

MISSION = """# Mission files

A mission is one YAML file. `glotouch check FILE` reports every mistake in it with file, line and column; nothing
moves. `glotouch schema` prints a JSON Schema of this page for editors.

```yaml
mission: ring
world: container_five
parameters:
  x: {type: float, unit: mm, default: -48, range: [-120, 120]}
tree:
  sequence:
    - retry: {attempts: 2, do: {press: {x_m: $x, force_N: 5 N}}}
    - condition: {port: height_m, at_least: 20 mm}
```
"""
TREE = """## Trees

A node is a name (`tool_return`), or a name with settings (`retry: {attempts: 3, do: ...}`). Names are those of
[nodes](nodes.md) and of installed [skills](skills.md). A YAML list is a sequence. Every node takes `name:`, the
name that messages, records and fault plans use. A second node of the same name is called `squeeze 2`.

A skill reads and writes **ports**. Each port is wired to a **key**, the place of its value. The default key is in the
column *key* of [skills](skills.md); mostly it is the port's name. `in: {port: key}` and `out: {port: key}` wire a port
to another key. An input port also takes a value: `in: {grip_m: 40 mm}`. `$name` stands for a mission parameter.
"""
SUBTREES = """## Subtrees

`subtree: {file: subtrees/explore.yaml, parameters: {...}, ports: {its_key: our_key}}` inserts the tree of another
file. The path is relative to the mission; shipped files are found as well ([their list](#shipped-subtrees)). All keys
that `ports` does not name are private. A mission may also hold its subtrees itself, in `subtrees: {NAME: {parameters:
..., tree: ...}}`, used as `file: NAME`. The `mission.yaml` of a run folder is written this way, so it needs no other
file.
"""
UNITS_TEXT = """## Units

A number without a unit is in SI units; a number with a unit is converted: `speed_m_s: 40 mm/s`. The suffix of a
name gives its unit: `grip_m`, `force_N`, `speed_m_s`. A number of another quantity is refused (`wrong_unit`).
"""
SHIPPED_SUBTREES = """## Shipped subtrees

`subtree: {file: subtrees/NAME.yaml, ...}` uses them in any mission. All keys in the last two columns can be shared with
`ports`. *Reads*: a key that the subtree reads and never writes. *Writes*: one that it writes; it may read it before.
"""


def page() -> str:
    """Return the page on mission files."""
    schema = mission_schema(SkillRegistry())
    meaning = {
        "mission": "name: letters, digits, `_` and `-`",
        "description": "one sentence for people",
        "world": "a [world](worlds.md): a path, a shipped name, or the world itself",
        "parameters": "values that `--set NAME=VALUE` may change, used as `$NAME`",
        "timeout_s": "longest duration of the mission on the robot's clock, in seconds without a unit",
        "leaves": "states that a successful run must end in, for example `{hand: object}`",
        "subtrees": "subtrees held in the mission itself",
        "tree": "the tree",
    }
    keys = [(code(k), "yes" if k in schema["required"] else "", meaning[k]) for k in schema["properties"]]
    by_si: dict[str, list[str]] = {}
    for unit, (si, _) in UNITS.items():
        by_si.setdefault(si, []).append(unit)
    ships = [describe_mission(file) for file in shipped("").values()]
    return "\n".join(
        (
            MISSION,
            table(("key", "required", "meaning"), keys),
            "## Parameters\n",
            "`glotouch run FILE --set x=30` overrides a default. A parameter that no node uses is reported.\n",
            fields(Declaration),
            TREE,
            SUBTREES,
            UNITS_TEXT,
            table(("SI unit", "accepted"), ((code(si) or "(ratio)", codes(units)) for si, units in by_si.items())),
            "## Shipped missions\n",
            table(
                ("mission", "goal", "parameters"),
                [(code(m["name"]), m["description"], codes(p["name"] for p in m["parameters"])) for m in ships],
            ),
            subtrees(),
        )
    )


def subtrees() -> str:
    """Return the section on the shipped subtrees."""
    found = [describe_subtree(file) for file in shipped("subtrees").values()]
    rows = [
        (
            code(s["name"]),
            s["description"],
            ", ".join(_parameter(p) for p in s["parameters"]),
            codes(s["reads"]),
            codes(s["writes"]),
        )
        for s in found
    ]
    return SHIPPED_SUBTREES + "\n" + table(("subtree", "result", "parameters (default)", "reads", "writes"), rows)


def _parameter(p: dict[str, Any]) -> str:
    """Return a parameter with its default; the number of objects has that of the world."""
    missing = "as in the world" if p["type"] == "count" else "required"
    given = str(p["default"]).lower() if isinstance(p["default"], bool) else p["default"]
    return f"{code(p['name'])} ({missing if given is None else code(given) or 'empty'})"
