"""next_probe: which candidate's outline or top the probe measures next."""

from __future__ import annotations

from dataclasses import replace

import pytest
import trimesh
from py_trees.common import Status

from glotouch_bt.perception.recognition import ProbeTouch
from glotouch_bt.perception.touch import TouchSet
from glotouch_skills.explore.next_probe import NextProbe


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("stl")
    trimesh.creation.cylinder(0.030, 0.070, sections=96).export(path / "can.stl")
    return path


@pytest.fixture
def asked(bench, folder):
    def ask(known, target="", params=None, **inputs):
        b = bench()
        b.context.world = replace(b.world, objects=replace(b.world.objects, folder=folder))
        skill = b.make(NextProbe, inputs={"known": known, **inputs}, target=target, **params or {})
        b.run(skill)
        assert not [c for c in b.commands if c.motion is not None]
        ask.of_kind = b.of_kind
        return skill

    return ask


@pytest.fixture
def things(found):
    """Outlines of the can, and of two objects that it cannot be: one is higher, the tops of the others are unknown."""
    can, thin, long = found.round((0.0, 0.0), 0.03), found.round((0.1, 0.0), 0.012, index=1), found.box(
        (-0.1, 0.0), (0.10, 0.04), index=2
    )  # fmt: skip
    known = zip((can, thin, long), (0.018, 0.1, 0.018), (0.9, 0.2, 0.5), strict=True)
    return tuple(replace(c, height_m=z, quality=q) for c, z, q in known)


def walk(asked, known, target="", **params):
    """Return (candidate, part) of all measurements, and the last answer."""
    made, inputs = [], {}
    for _ in range(20):
        skill = asked(known, target, params, **inputs)
        assert skill.status is Status.SUCCESS, skill.feedback_message
        if skill.measured_enough:
            assert skill.next_part == ""
            return made, skill
        made.append((skill.candidate.index, skill.next_part))
        known, inputs = skill.candidates, {"before": skill.probed}
    pytest.fail("it never ends")


def test_without_a_target_all_outlines_come_first_the_least_known_before_the_others(asked, things) -> None:
    made, last = walk(asked, things)
    assert made == [(i, part) for part in ("outline", "top") for i in (1, 2, 0)]
    assert last.unmeasured == 0
    assert last.probed == tuple(ProbeTouch(i, part) for i, part in made)


def test_the_tops_can_be_left_for_later_without_a_target(asked, things) -> None:
    made, _ = walk(asked, things, outlines_only=True)
    assert made == [(i, "outline") for i in (1, 2, 0)]
    made, _ = walk(asked, things, "can", outlines_only=True)
    assert sorted(part for _, part in made) == ["outline", "top"]


def test_with_a_target_only_what_may_be_it_is_measured(asked, things) -> None:
    made, last = walk(asked, things, "can")
    assert {i for i, _ in made} == {0}
    assert sorted(part for _, part in made) == ["outline", "top"]
    assert last.unmeasured == 2


def test_what_was_put_off_is_measured_once_the_jaws_were_used(asked, found) -> None:
    things = found.round((0.0, 0.0), 0.03), found.round((0.1, 0.0), 0.031, index=1)
    known = tuple(replace(c, top_touched=False) for c in things)  # no top was met
    before = tuple(ProbeTouch(0, part) for part in ("outline", "top"))
    first = asked(known, "can", before=before)
    assert (first.measured_enough, first.postponed) == (True, 1)
    again = asked(known, "can", before=before, felt=(TouchSet(known[0], ()),))
    assert (again.candidate.index, again.next_part) == (1, "outline")


def test_what_was_measured_last_replaces_what_was_known(asked, things) -> None:
    new = replace(things[1], height_m=0.05)
    skill = asked(things, measured=new, chosen="outline", before=(ProbeTouch(1, "outline"),))
    assert skill.candidates == (things[0], new, things[2])
    assert (skill.candidate, skill.next_part) == (things[2], "outline"), "the next one"


@pytest.mark.parametrize(("chosen", "kept"), [("top", [0, 2]), ("outline", [0, 1, 2])])
def test_what_is_gone_is_no_candidate_any_more(asked, things, chosen: str, kept: list[int]) -> None:
    skill = asked(things, measured=things[1], chosen=chosen, gone=True, before=(ProbeTouch(1, chosen),))
    assert [c.index for c in skill.candidates] == kept
    assert [e["candidates"] for e in asked.of_kind("forgotten")] == ([[1]] if chosen == "top" else [])
    alone = asked(things[1:2], measured=things[1], chosen=chosen, gone=True, before=(ProbeTouch(1, chosen),))
    assert alone.candidates == things[1:2], "one is kept: without any there would be nothing to trace anew"


def test_contacts_that_pass_to_a_neighbour_are_recorded_with_both(asked, found, tool) -> None:
    """A contact with the second disc was traced with the first one."""
    one, other = found.round((0.0, 0.0), 0.03), found.round((0.065, 0.0), 0.03, index=1)
    mixed = replace(one, contacts=(*one.contacts, other.contacts[-1])), replace(other, contacts=other.contacts[:-1])
    skill = asked(mixed, tool=tool)
    now = {c["candidate"].index: len(c["candidate"].contacts) for c in asked.of_kind("candidate")}
    assert now == {c.index: len(c.contacts) for c in skill.candidates} == {0: len(one.contacts), 1: len(other.contacts)}


def test_begun_anew_it_keeps_what_was_found_since(asked, things) -> None:
    """`candidate` is still the one that was measured last, the search has gone on meanwhile."""
    made = tuple(ProbeTouch(i, part) for i in (0, 2, 1) for part in ("outline", "top"))
    skill = asked(things, measured=replace(things[0], height_m=0.05), chosen="", before=made)
    assert skill.measured_enough
    assert skill.candidates == things


@pytest.mark.parametrize("known", [None, ()])
def test_nothing_is_known(bench, known) -> None:
    b = bench()
    skill = b.make(NextProbe, inputs={} if known is None else {"known": known})
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_candidates")
