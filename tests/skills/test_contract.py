"""Declared failures and resources of skills agree with their code: every `Failure` in reach, by AST."""

from __future__ import annotations

import ast
import importlib
import inspect
import textwrap
from collections.abc import Iterator
from types import FunctionType
from typing import Any

import pytest

from glotouch_bt.mission.read.library import SkillRegistry
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import UNCHANGED, Failure, Reason, Skill, SkillParams, SkillRun, UndeclaredFailure
from glotouch_skills.recheck import Recheck

SHELF = SkillRegistry()
NAMES = sorted(n for n in SHELF if SHELF[n].__module__.startswith("glotouch_skills."))
# What the base class adds to every skill, and what motions raise deep below (MotionRefused), are not looked for.
NOT_SEARCHED = {"motion_refused", "not_at_rest"}
SEARCHED = ("glotouch_skills.", "glotouch_bt.skill.probing")


def reachable(skill: type[Skill]) -> set[str]:
    """Codes of every `Failure` that code reachable from a skill's methods names: a name used counts as a call.

    A class that is named brings in all of its methods. The declarations in a class, outside its methods, do not count.
    """
    codes: set[str] = set()
    todo: list[object] = [skill]
    seen: set[object] = {skill}
    while todo:
        here: Any = todo.pop()
        names = vars(importlib.import_module(here.__module__))
        for node in _bodies(here):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self":
                found = getattr(here, node.attr, None)
            else:
                found = names.get(node.id) if isinstance(node, ast.Name) else None
            if isinstance(found, Failure):
                codes.add(found.code)
            elif isinstance(found, type | FunctionType) and found.__module__.startswith(SEARCHED) and found not in seen:
                seen.add(found)
                todo.append(found)
    return codes


def _bodies(found: Any) -> Iterator[ast.AST]:
    """Every node of a function, or of a class's methods."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(found))).body
    parts = [n for n in tree.body if isinstance(n, ast.FunctionDef)] if isinstance(tree, ast.ClassDef) else [tree]
    for part in parts:
        yield from ast.walk(part)


@pytest.mark.parametrize("name", NAMES)
def test_declared_failures_are_those_the_code_can_raise(name: str) -> None:
    assert set(SHELF[name].failures()) - NOT_SEARCHED == reachable(SHELF[name]) - NOT_SEARCHED


def test_the_resume_check_declares_the_failures_its_code_can_raise() -> None:
    assert set(Recheck.failures()) - NOT_SEARCHED == reachable(Recheck) - NOT_SEARCHED


@pytest.mark.parametrize("name", NAMES)
def test_every_declared_failure_says_what_it_means_and_what_to_do(name: str) -> None:
    for code, failure in SHELF[name].failures(general=True).items():
        assert code == failure.code
        assert failure.meaning
        assert failure.advice


@pytest.mark.parametrize("name", NAMES)
def test_the_docstring_leaves_failures_to_their_declarations(name: str) -> None:
    assert "FAILURE" not in (SHELF[name].__doc__ or "")


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
    KNOWN = Failure("known", "as declared")

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
