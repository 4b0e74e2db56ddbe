"""Compare `glotouch check` with py_trees on seeded mistakes.

For py_trees, each mission is built from its composites, decorators and ports; node kinds it lacks are ours. Every skill
is a stub with the real ports that reads all inputs, writes a value of the right type to each output and succeeds. The
tree is set up and ticked to its end. Mistakes that plain Python would raise count as found when the tree is built.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import py_trees
from py_trees.common import Status

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import Scope, SkillRegistry, parse_tree, parse_yaml, read_parameters, shipped, substitute
from glotouch_bt.mission.spec import Finding, Findings, Map, MissionFaults, NodeSpec, number_names
from glotouch_bt.mission.tree import build_tree
from glotouch_bt.skill import Context, Out, Skill, SkillParams
from glotouch_bt.validation.seeded_mistakes.mistakes import MISTAKES, RIGHT, Mistake

MAX_TICKS = 2000
IN_PYTHON = {"unknown_skill", "missing_parameter", "unknown_parameter", "unknown_port"}
"""Findings that plain Python code would raise as an exception where the node is created."""


@dataclass(frozen=True)
class MistakeRow:
    """Result of one mistake.

    Attributes:
        mistake: The mistake.
        ours: Our finding on the right line, or None.
        py_trees: Error of py_trees, or empty.
        when: build, setup, tick N, or never.
    """

    mistake: Mistake
    ours: Finding | None
    py_trees: str
    when: str


def compare() -> list[MistakeRow]:
    """Try every seeded mistake with both."""
    return [_row(m) for m in MISTAKES]


def false_alarms() -> tuple[int, int]:
    """Return (false findings in correct missions, number of missions), over the variants and the shipped missions."""
    found = [*map(_found, RIGHT.values()), *(load_mission(name).warnings for name in shipped(""))]
    return sum(len(alarms(f)) for f in found), len(found)


def alarms(found: Iterable[Finding]) -> list[Finding]:
    """Return the findings that would be false in a correct mission. An optional input may stay unwritten on purpose."""
    return [f for f in found if f.code != "input_never_written"]


def _found(text: str) -> list[Finding]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.yaml"
        path.write_text(text, encoding="utf-8")
        try:
            return list(load_mission(path).warnings)
        except MissionFaults as e:
            return [*e.findings, *e.warnings]


def _row(mistake: Mistake) -> MistakeRow:
    ours = next((f for f in _found(mistake.text) if f.code == mistake.code and f.place.line == mistake.line), None)
    said, when = _in_py_trees(mistake)
    return MistakeRow(mistake, ours, said, when)


def _in_py_trees(mistake: Mistake) -> tuple[str, str]:
    spec, findings = _spec(mistake.text)
    for finding in findings.sorted():
        if finding.code in IN_PYTHON and finding.code == mistake.code:
            return "NameError or TypeError", "build"
    if mistake.code == "not_a_node" or any(n.is_unread or not _complete(n) for n in spec.walk()):
        return "cannot be written without our format", "build"
    _stub(spec)
    context = Context(None, None, None, None, SimpleNamespace(now_s=0.0))  # type: ignore[arg-type]
    when = "build"
    with _quiet():
        try:
            built = build_tree(spec, context, "m")
            tree = py_trees.trees.BehaviourTree(built.root)
            when = "setup"
            tree.setup()
            for tick in range(1, MAX_TICKS + 1):
                when = f"tick {tick}"
                tree.tick()
                if tree.root.status is not Status.RUNNING:
                    break
        except Exception as e:
            return f"{type(e).__name__}: {e}".splitlines()[0][:90], when
        finally:
            py_trees.blackboard.Blackboard.clear()
    if built.root.status is Status.FAILURE:
        return "the tree ends in FAILURE, without a reason", when
    return "", "never"


def _spec(text: str) -> tuple[NodeSpec, Findings]:
    findings = Findings()
    source = parse_yaml(text.encode(), "m.yaml")
    assert isinstance(source, Map)
    parameters = read_parameters(source.get("parameters"), {}, findings, None)
    tree = source.get("tree")
    assert tree is not None
    spec = parse_tree(
        substitute(tree, parameters, findings), Scope(SkillRegistry(), findings, Path("m.yaml"), (Path().resolve(),))
    )
    number_names(spec)
    return spec, findings


def _complete(node: NodeSpec) -> bool:
    """Return True if the tree can be built: all settings are usable. Skill parameters do not matter to a stub."""
    return node.skill_type is not None or node.settings is not None


def _stub(spec: NodeSpec) -> None:
    for node in spec.walk():
        if node.skill_type is not None:
            node.skill_type, node.params = _stub_of(node.skill_type), SkillParams()


def _stub_of(skill: type[Skill]) -> type[Skill]:
    elements = {p: getattr(skill, p).element for p in skill.OUTPUT_PORTS}

    def update(self: Any) -> Status:
        for port, info in skill.INPUT_PORTS.items():
            if info.required or self.blackboard_client.exists(port):
                self.get_input(port)
        for port, info in skill.OUTPUT_PORTS.items():
            declared: Out[Any] = getattr(skill, port)
            value = _value(info.data_type, elements[port]) if declared.on_success is None else declared.on_success
            self._set_output(port, value)
        return Status.SUCCESS

    def init(self: Any, name: str, params: object, context: object) -> None:
        py_trees.behaviour.Behaviour.__init__(self, name)

    body = {
        "__init__": init,
        "update": update,
        "INPUT_PORTS": dict(skill.INPUT_PORTS),
        "OUTPUT_PORTS": dict(skill.OUTPUT_PORTS),
    }
    made: Any = type(skill.__name__, (py_trees.ports.PortsMixin, py_trees.behaviour.Behaviour), body, register=False)
    return made  # type: ignore[no-any-return]


def _value(kind: Any, element: type | None = None) -> object:
    if kind is tuple:
        return (_value(element),) if element is not None else ()
    if kind in (bool, int, float, str):
        return kind(1)
    if args := get_args(kind):
        return _value(args[0])
    made: object = object.__new__(type(kind.__name__, (kind,), {"__repr__": object.__repr__}))
    with contextlib.suppress(AttributeError):
        object.__setattr__(made, "quality", 1.0)
    return made


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    level = py_trees.logging.level
    py_trees.logging.level = py_trees.logging.Level.ERROR
    try:
        yield
    finally:
        py_trees.logging.level = level


def summary(rows: list[MistakeRow]) -> dict[str, object]:
    """Return the counts as JSON data."""
    alarms, missions = false_alarms()
    named = [r for r in rows if r.py_trees and r.when in ("build", "setup")]
    ticked = [r for r in rows if r.py_trees and r.when.startswith("tick")]
    return {
        "mistakes": len(rows),
        "found": sum(r.ours is not None for r in rows),
        "with_path": sum(r.ours is not None and len(r.ours.path) > 1 for r in rows),
        "py_trees_before_ticking": len(named),
        "py_trees_while_ticking": len(ticked),
        "py_trees_never": sum(not r.py_trees for r in rows),
        "false_alarms": alarms,
        "right_missions": missions,
    }


def as_markdown(rows: list[MistakeRow]) -> str:
    """Return the comparison as a Markdown table."""
    lines = ["| mistake | glotouch check | py_trees 2.6 |", "|---|---|---|"]
    for row in rows:
        ours = f"line {row.ours.place.line}, `{row.ours.code}`" if row.ours else "not found"
        theirs = f"{row.when}: {row.py_trees}" if row.py_trees else "nothing"
        lines.append(f"| {row.mistake.name} | {ours} | {theirs.replace('|', '/')} |")
    return "\n".join(lines) + "\n"
