"""Mistakes that writers of skills make are named with their place."""

from __future__ import annotations

import pytest

from glotouch_bt.skill import Out, Skill, SkillParams, SkillRun


class Forgetful(Skill):
    """Forgets `yield from`."""

    Params = SkillParams

    def run(self) -> SkillRun:
        yield from self.context.arm.jaws(0.02)
        self.context.arm.shift([0.0, 0.0, 0.02], 0.05)


class Silent(Skill):
    """Writes none of its outputs."""

    Params = SkillParams
    height_m = Out(float, "height")

    def run(self) -> SkillRun:
        yield from self.context.arm.hold(0.02)


def test_a_motion_that_is_not_run_is_an_error(bench) -> None:
    b = bench()
    with pytest.raises(TypeError, match=r"'shift' at .*test_own_mistakes\.py:17 was made and not run"):
        b.run(b.make(Forgetful))


def test_an_output_that_is_not_written_is_an_error(bench) -> None:
    b = bench()
    with pytest.raises(TypeError, match=r"without writing the output 'height_m': write `self\.height_m"):
        b.run(b.make(Silent))


class NoYield(Skill):
    """Returns at once what it should yield."""

    def run(self) -> SkillRun:
        return 3  # type: ignore[return-value]


def test_run_is_a_generator(bench) -> None:
    b = bench()
    with pytest.raises(TypeError, match=r"run\(\) is no generator but returned 3: it has no `yield`"):
        b.run(b.make(NoYield))
