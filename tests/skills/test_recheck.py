"""Before a mission goes on in a world that went on without it: what changed is found, what did not is no obstacle."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glotouch_bt.mission.read.library import SkillRegistry
from glotouch_bt.perception.touch import Candidate, Contour
from glotouch_bt.skill import SkillFailed
from glotouch_skills.recheck import Recheck, _reach_m


def candidate(kind: Any, centre: tuple[float, float], size: tuple[float, float], yaw: float = 0.0) -> Candidate:
    contour = Contour(kind, np.array(centre), size, yaw, 0.0, np.zeros(0))
    return Candidate(0, contour, 0.05, 1.0, ())


@pytest.mark.parametrize("angle", np.linspace(0.0, 2 * np.pi, 13).tolist())
def test_the_outline_s_reach_is_where_a_ray_leaves_it(angle: float) -> None:
    """A circle's radius; of a turned rectangle, the nearer of the two sides that the ray meets."""
    out = np.array([np.cos(angle), np.sin(angle)])
    assert _reach_m(candidate("round", (0.02, 0.03), (0.06, 0.06)), out) == pytest.approx(0.03, abs=1e-6)
    yaw, half = 0.4, np.array([0.04, 0.02])
    c, s = abs(np.cos(angle - yaw)), abs(np.sin(angle - yaw))
    expected = min(half[0] / c if c > 1e-12 else np.inf, half[1] / s if s > 1e-12 else np.inf)
    found = _reach_m(candidate("box", (0.0, 0.0), (0.08, 0.04), yaw), out)
    assert found == pytest.approx(expected, abs=1e-6)


def judge(point: tuple[float, float] | None) -> None:
    skill = Recheck.__new__(Recheck)
    skill.params = Recheck.Params()
    skill._judge(candidate("round", (0.0, 0.0), (0.06, 0.06)), None if point is None else np.array(point))


def test_recheck__candidate_moved__unless_the_contact_is_on_the_outline() -> None:
    judge((0.034, 0.0))
    judge((0.0, -0.026))
    for point in ((0.040, 0.0), (0.0, 0.020), None):
        with pytest.raises(SkillFailed) as e:
            judge(point)
        assert e.value.reason.code == "candidate_moved"
        assert "--from" in e.value.reason.advice


def test_every_skill_that_remembers_something_says_so_to_checkpoints() -> None:
    """An attribute of its own that is no port lives from one run of the skill to the next; `remember` must know it."""
    registry = SkillRegistry()
    forgetful = []
    for name in registry:
        skill = registry[name]
        tree = ast.parse(Path(inspect.getsourcefile(skill) or "").read_text())
        (found,) = (n for n in ast.walk(tree) if isinstance(n, ast.ClassDef) and n.name == skill.__name__)
        stored = {
            n.attr
            for n in ast.walk(found)
            if isinstance(n, ast.Attribute)
            and isinstance(n.ctx, ast.Store)
            and isinstance(n.value, ast.Name)
            and n.value.id == "self"
        }
        if stored - {*skill.INPUT_PORTS, *skill.OUTPUT_PORTS} and "remember" not in vars(skill):
            forgetful.append(name)
    assert not forgetful


class Stood(Recheck):
    """What it would do first, without an arm."""

    tool = None  # type: ignore[assignment]


@pytest.mark.parametrize(("aperture_mm", "held"), [(15.0, True), (40.0, False)])
def test_recheck__tool_lost__aperture_decides_whether_the_probe_is_held(aperture_mm: float, held: bool) -> None:
    told: list[bool] = []
    arm = SimpleNamespace(
        aperture_m=1e-3 * aperture_mm, scene=SimpleNamespace(holding_tool=True, hold_tool=told.append)
    )
    skill = Stood.__new__(Stood)
    skill.context = SimpleNamespace(arm=arm)  # type: ignore[assignment]
    tool: Any = SimpleNamespace(aperture_m=0.0149)
    assert skill._as_wide_as(tool) is held
    if not held:
        with pytest.raises(SkillFailed) as e:
            skill._require_tool(tool)
        assert e.value.reason.code == "tool_lost"
