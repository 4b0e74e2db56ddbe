"""What skills declare about failures and resources, against their own code: every SkillFailed in reach, by AST."""

from __future__ import annotations

import ast
import importlib
import re
from functools import cache
from pathlib import Path
from typing import ClassVar

import pytest

import glotouch_skills
from glotouch_bt.mission.read.library import SkillShelf
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import UNCHANGED, Reason, Skill, SkillParams, SkillRun, UndeclaredFailure

FOLDER = Path(glotouch_skills.__path__[0])
SHELF = SkillShelf()
NAMES = sorted(n for n in SHELF if SHELF[n].__module__.startswith("glotouch_skills."))
# What the base class adds to every skill, and what motions raise deep below (MotionRefused), are not looked for.
NOT_SEARCHED = {"motion_refused", "not_at_rest"}


SEARCHED = ("glotouch_skills.", "glotouch_bt.skill.probing")


def _defined(door: str, name: str) -> str:
    """Module in which a name that a door offers is defined; a constant's is the door's."""
    return str(getattr(getattr(importlib.import_module(door), name), "__module__", door))


class _Module:
    """Functions of one module of `skills` by name (`Class.method` for methods), and where imported names come from."""

    def __init__(self, name: str) -> None:
        tree = ast.parse(Path(str(importlib.import_module(name).__file__)).read_text())
        self.bodies: dict[str, ast.AST] = {}
        self.imports: dict[str, tuple[str, str]] = {}
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                self.bodies[node.name] = node
            elif isinstance(node, ast.ClassDef):
                self.bodies[node.name] = ast.Pass()
                self.bodies |= {f"{node.name}.{m.name}": m for m in node.body if isinstance(m, ast.FunctionDef)}
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(SEARCHED):
                self.imports |= {a.asname or a.name: (_defined(str(node.module), a.name), a.name) for a in node.names}


@cache
def module(name: str) -> _Module:
    return _Module(name)


def reachable(start: str, cls: str) -> set[str]:
    """Codes of every SkillFailed in code reachable from a skill's methods: a name used counts as a call.

    A class that is named (or whose instance may be: any method name of a class imported) brings in all of its methods.
    """
    codes: set[str] = set()
    todo = [(start, n) for n in module(start).bodies if n.startswith(f"{cls}.")]
    seen = set(todo)
    while todo:
        at, name = todo.pop()
        here = module(at)
        for node in ast.walk(here.bodies[name]):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "SkillFailed":
                assert isinstance(node.args[0], ast.Constant), f"{at}.{name}: the code must be a literal"
                codes.add(str(node.args[0].value))
            word = node.id if isinstance(node, ast.Name) else None
            if word is None:
                continue
            where, what = here.imports.get(word, (at, word))
            for other in module(where).bodies:
                if (other == what or other.startswith(f"{what}.")) and (where, other) not in seen:
                    seen.add((where, other))
                    todo.append((where, other))
    return codes


@pytest.mark.parametrize("name", NAMES)
def test_declared_failures_are_those_the_code_can_raise(name: str) -> None:
    skill = SHELF[name]
    assert set(skill.FAILURES) - NOT_SEARCHED == reachable(skill.__module__, skill.__name__)


@pytest.mark.parametrize("name", NAMES)
def test_the_docstring_names_no_other_failure(name: str) -> None:
    text = SHELF[name].__doc__ or ""
    told = set(re.findall(r"`(\w+)`", " ".join(re.findall(r"FAILURE ([^:]*):", text))))
    assert told <= set(SHELF[name].FAILURES)


@pytest.mark.parametrize("name", NAMES)
def test_declared_states_fit_together(name: str) -> None:
    skill = SHELF[name]
    assert set(skill.POSTCONDITIONS) | set(skill.FAILURE_STATES) <= set(skill.PRECONDITIONS), (
        "what it changes it must ask for"
    )
    for resource, states in skill.PRECONDITIONS.items():
        assert states
        assert UNCHANGED not in states
        assert skill.POSTCONDITIONS.get(resource) != UNCHANGED
    for resource in skill.RESTORED_BY:
        back = SHELF[skill.RESTORED_BY[resource]]
        assert skill.POSTCONDITIONS[resource] in back.PRECONDITIONS[resource]
        assert back.POSTCONDITIONS[resource] != skill.POSTCONDITIONS[resource]


class _Undeclared(Skill):
    FAILURES: ClassVar = {"known": "as declared"}

    def run(self) -> SkillRun:
        yield HOLD


def test_a_code_that_is_not_declared_fails_a_test_and_nothing_else() -> None:
    skill = _Undeclared("x", SkillParams(), None)  # type: ignore[arg-type]
    with pytest.warns(UndeclaredFailure, match="_Undeclared does not declare 'unknown'"):
        skill._fail(Reason("unknown", "not declared"))
    assert skill.reason is not None
    assert skill.reason.node == "x"
    skill._fail(Reason("known", ""))
    skill._fail(Reason("not_at_rest", ""))


def test_every_failure_says_what_to_do() -> None:
    """Every `SkillFailed(...)` of the skills carries an advice."""
    silent = [
        f"{path.name}:{call.lineno}"
        for path in sorted(FOLDER.glob("*.py"))
        for call in ast.walk(ast.parse(path.read_text()))
        if isinstance(call, ast.Call)
        and getattr(call.func, "id", "") == "SkillFailed"
        and "advice" not in {k.arg for k in call.keywords}
    ]
    assert silent == []
