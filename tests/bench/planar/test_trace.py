"""Tracing driven through planar worlds whose outlines are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import trimesh

from glotouch_bt.bench.planar import ContactModel, PlanarWorld
from glotouch_bt.motion import drive
from glotouch_bt.perception.search import (
    Move,
    MoveOutcome,
    OutlineTrace,
    TraceParams,
    of_another,
    taken_by,
    trace,
    trace_more,
)
from glotouch_bt.perception.search.bodies import outline_of
from glotouch_bt.perception.search.candidates import quality
from glotouch_bt.perception.search.tracing.trace_state import TraceState
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.robot.scene.meshes import Mesh
from glotouch_skills.explore.orbit_probe import OrbitProbeParams
from glotouch_skills.explore.refine_outline import RefineOutlineParams
from tests.bench.planar.conftest import TIP, WorldOf, as_mesh, box, centres_of, cylinder

CENTRE = np.array([0.02, -0.03])
INNER = np.array([0.138, 0.188])


def touched_from(world: PlanarWorld, angle: float) -> Contact:
    """The first contact: straight towards the first object from a direction."""
    out = np.array([np.cos(angle), np.sin(angle)])
    centre = centres_of(world)[0]
    world.lowered, world.tip_K_m = True, centre + 0.085 * out
    felt = world.execute(Move("sweep", centre))
    assert felt.contact is not None
    return felt.contact


def traced(world: PlanarWorld, first: Contact, params: TraceParams | None = None) -> OutlineTrace:
    return drive(trace(first, world.tip_K_m, TIP, params, half_extent_m=INNER), world.execute)


@pytest.mark.parametrize(
    ("radius", "angle"), [(0.02, 0.3), (0.03, -1.9), pytest.param(0.04, 2.5, marks=pytest.mark.study)]
)
def test_a_disc_is_where_it_is_and_as_large(world_of: WorldOf, radius: float, angle: float) -> None:
    world = world_of([cylinder(radius)], [(*CENTRE, 0)])
    result = traced(world, touched_from(world, angle))
    assert result.contour is not None
    assert result.contour.family == "circle"
    # in the world's own words: contacts are exact, the object stands where it is now
    np.testing.assert_allclose(result.contour.centre_K_m, centres_of(world)[0], atol=3e-4)
    assert result.contour.size_m[0] == pytest.approx(2 * radius, abs=6e-4)
    assert TraceParams().min_contacts <= len(result.contacts) <= TraceParams().max_contacts
    assert result.outliers == ()
    assert result.ended
    assert np.linalg.norm(result.displaced_K_m - (centres_of(world)[0] - CENTRE)) < 5e-4


def test_a_box_is_traced_within_its_bounds(world_of: WorldOf) -> None:
    world = world_of([box(0.09, 0.05)], [(*CENTRE, 0.4)])
    result = traced(world, touched_from(world, 1.2))
    assert result.contour is not None
    np.testing.assert_allclose(result.contour.centre_K_m, centres_of(world)[0], atol=2e-3)
    np.testing.assert_allclose(sorted(result.contour.size_m), [0.05, 0.09], atol=5e-3)
    assert len(result.contacts) <= TraceParams().max_contacts


def test_the_most_contacts_are_a_bound(world_of: WorldOf) -> None:
    world = world_of([cylinder(0.03)], [(*CENTRE, 0)])
    params = TraceParams(centre_sd_m=1e-9, radial_sd_m=1e-9, min_contacts=3, max_contacts=6)
    assert len(traced(world, touched_from(world, 0.0), params).contacts) == 6


def test_what_has_gone_ends_with_few_contacts(world_of: WorldOf) -> None:
    world = world_of([cylinder(0.03)], [(*CENTRE, 0)])
    first = touched_from(world, 0.7)
    world.poses[0, :2] = (-0.1, 0.14)
    result = traced(world, first)
    assert len(result.contacts) < 3
    assert result.ended
    assert world.travel_m < 2.5


@pytest.mark.parametrize("radius", [0.018, 0.022, 0.025])
@pytest.mark.parametrize("beside", [(-0.034, 0.012), (-0.03, 0.02), (0.012, -0.034)])
def test_what_was_touched_at_a_limbs_end_is_beside_it(
    world_of: WorldOf, radius: float, beside: tuple[float, float]
) -> None:
    """A disc with a limb too thin to be drawn: the ball meets its end head-on, and there is nothing behind it."""
    world = world_of([cylinder(radius)], [(*(CENTRE + beside), 0)])
    out = -np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    tip = np.array([*CENTRE, 0.018])
    first = Contact(0.0, tip, -out, out, (tip - TIP * out)[:2], 1.0)
    world.lowered, world.tip_K_m = True, tip[:2] + 0.004 * out[:2]
    result = drive(trace(first, world.tip_K_m, TIP, OrbitProbeParams().rule(), half_extent_m=INNER), world.execute)
    assert len(result.contacts) >= TraceParams().min_contacts
    assert result.outline is not None
    assert np.linalg.norm(result.outline.centre_K_m - centres_of(world)[0]) < 0.02


def test_what_turns_out_to_be_known_is_not_traced_to_the_end(world_of: WorldOf) -> None:
    world = world_of([box(0.09, 0.05)], [(*CENTRE, 0.4)])
    first, asked = touched_from(world, 1.2), list[int]()

    def joined(contacts: tuple[Contact, ...]) -> bool:
        asked.append(len(contacts))
        return len(contacts) == 5

    params = TraceParams(centre_sd_m=1e-9, radial_sd_m=1e-9)
    plan = trace(first, world.tip_K_m, TIP, params, half_extent_m=INNER, joined=joined)
    result = drive(plan, world.execute)
    assert (result.ended, len(result.contacts)) == ("it is an object that is known", 5)
    assert min(asked) == params.min_contacts


def test_what_is_too_small_is_no_object(world_of: WorldOf) -> None:
    world = world_of([cylinder(0.01)], [(*CENTRE, 0)])
    first = touched_from(world, 0.4)
    assert traced(world, first, TraceParams(smallest_m=0.0)).ended == "the outline is known"
    again = world_of([cylinder(0.01)], [(*CENTRE, 0)])
    assert traced(again, touched_from(again, 0.4)).ended != "the outline is known"


def test_a_contact_that_faces_the_middle_is_with_something_else(world_of: WorldOf) -> None:
    """On the way round something pushes the ball towards what is traced: no surface of its own can."""

    class Intruded:
        met: Contact | None = None

        def execute(self, move: Move) -> MoveOutcome:
            felt = world.execute(move)
            if self.met is not None or move.kind != "step" or felt.contact is not None:
                return felt
            towards = CENTRE - felt.tip_K_m
            away = -np.array([*towards, 0.0]) / np.linalg.norm(towards)
            tip = np.array([*felt.tip_K_m, 0.018])
            self.met = Contact(1.0, tip, away, -away, felt.tip_K_m + TIP * away[:2], 1.0)
            return replace(felt, contact=self.met)

    world, intruded = world_of([cylinder(0.03)], [(*CENTRE, 0)]), Intruded()
    first = touched_from(world, np.pi)
    result = drive(trace(first, world.tip_K_m, TIP, half_extent_m=INNER), intruded.execute)
    assert intruded.met is not None
    assert [s is intruded.met for s in result.outliers] == [True]
    assert result.contour is not None
    np.testing.assert_allclose(result.contour.centre_K_m, centres_of(world)[0], atol=5e-4)


@pytest.mark.study
def test_what_moved_unfelt_is_traced_anew(world_of: WorldOf) -> None:
    """Something shoved it by 7 to 12 mm after it had been traced coarsely; what nobody moved is left in peace.

    A long box that also turns while it is probed can pass for a longer one: of 16 at most four are missed.
    """
    missed = 0
    for k, solid in enumerate((cylinder(0.03), box(0.07, 0.05), cylinder(0.022), box(0.09, 0.04))):
        for shift in [(0.006, 0.004), (-0.009, 0.002), (0.002, -0.010), (0.012, 0.0), (0.0, 0.0)]:
            world = world_of([solid], [(*CENTRE, 0.3)], ContactModel(), seed=k)
            first = touched_from(world, 0.7 + k)
            before = traced(world, first, TraceParams(centre_sd_m=5e-3, radial_sd_m=0.02, min_contacts=5))
            world.poses[0, :2] += shift
            result = drive(trace_more(before.contacts, world.tip_K_m, TIP, half_extent_m=INNER), world.execute)
            assert result.contour is not None
            off = float(np.linalg.norm(result.contour.centre_K_m - centres_of(world)[0]))
            if shift == (0.0, 0.0):
                assert result.moves == 0
                assert off < 1e-3
            else:
                missed += result.moves == 0
    assert missed <= 4


def three_limbs() -> Mesh:
    """Three bars from one middle, 34 mm long, 12 mm wide."""
    bars = []
    for k in range(3):
        bar = trimesh.creation.box((0.034, 0.012, 0.06))
        bar.apply_translation((0.017, 0.0, 0.0))
        bar.apply_transform(trimesh.transformations.rotation_matrix(2 * np.pi * k / 3, (0, 0, 1)))
        bars.append(bar)
    return as_mesh(trimesh.util.concatenate(bars), "limbs")


def refine(world: PlanarWorld, before: OutlineTrace, moves: list[tuple[Move, MoveOutcome]]) -> OutlineTrace:
    """As `refine_outline` goes on; what it does is written down."""

    class Watched:
        def execute(self, move: Move) -> MoveOutcome:
            felt = world.execute(move)
            moves.append((move, felt))
            return felt

    rule = RefineOutlineParams().rule()
    return drive(trace_more(before.contacts, world.tip_K_m, TIP, rule, half_extent_m=INNER), Watched().execute)


@pytest.mark.study
def test_refining_finds_every_limb(world_of: WorldOf) -> None:
    """A coarse trace that went round part of it leaves limbs that nothing predicts; the hull's centre needs them all.

    One of six may be spoilt by a turn that nobody felt. The ball never goes beside the object while it stands on it.
    """
    found = landed = 0
    for k, angle in enumerate((0.2, 1.3, 2.4, 3.5, 4.6, 5.7)):
        world = world_of([three_limbs()], [(*CENTRE, 0.3)], ContactModel(), seed=k)
        coarse = TraceParams(centre_sd_m=6e-3, radial_sd_m=0.0225, min_contacts=4, max_contacts=5)
        before = traced(world, touched_from(world, angle), coarse)
        moves: list[tuple[Move, MoveOutcome]] = []
        result = refine(world, before, moves)
        assert result.contour is not None
        centre, yaw = world.poses[0, :2], world.poses[0, 2]
        off = np.array([c.point_K_m for c in result.contacts]) - centre
        reach = [float(np.max(off @ [np.cos(yaw + a), np.sin(yaw + a)])) for a in (0, 2 * np.pi / 3, 4 * np.pi / 3)]
        found += min(reach) > 0.022 and float(np.linalg.norm(result.contour.centre_K_m - centre)) < 5e-3
        up = False
        for move, felt in moves:
            assert move.kind == "hop" or not up
            if move.kind == "hop" and not felt.refused:
                up = felt.contact is not None
                landed += up
    assert found >= 5
    assert landed > 0


def test_refining_beside_a_neighbour_keeps_to_its_object(world_of: WorldOf) -> None:
    """A disc stands 14 mm off a limb: the ball passes, and contacts with both are nearer than parts of one may be."""
    middle, along = np.array([0.0, -0.03]), np.array([np.cos(0.3), np.sin(0.3)])
    disc = middle + (0.034 + 0.014 + 0.030) * along
    world = world_of([three_limbs(), cylinder(0.03)], [(*middle, 0.3), (*disc, 0)], ContactModel(), seed=1)
    world.lowered, world.tip_K_m = True, disc + 0.06 * along
    met = world.execute(Move("sweep", disc)).contact
    assert met is not None
    contacts = traced(world, met, OrbitProbeParams().rule()).contacts
    outline = outline_of(contacts, TIP)
    neighbour = Candidate(1, outline.contour, 0.018, quality(outline), contacts)
    coarse = TraceParams(centre_sd_m=6e-3, radial_sd_m=0.0225, min_contacts=4, max_contacts=5)
    before = traced(world, touched_from(world, 1.3), coarse)
    rule, elsewhere = RefineOutlineParams().rule(), partial(of_another, (neighbour,), TIP)
    plan = trace_more(before.contacts, world.tip_K_m, TIP, rule, half_extent_m=INNER, elsewhere=elsewhere)
    result = drive(plan, world.execute)
    tips = np.array([c.tip_K_m[:2] for c in result.contacts])
    assert (np.abs(world.clearance(tips, 0)) < np.abs(world.clearance(tips, 1))).all()
    assert result.contour is not None
    assert float(np.linalg.norm(result.contour.centre_K_m - centres_of(world)[0])) < 3e-3


def test_nothing_is_probed_where_a_known_neighbour_stands(world_of: WorldOf) -> None:
    """A disc touches a box in the middle of its side: there, the ball would only touch the disc again."""
    disc = CENTRE + np.array([0.0, 0.025 + 0.030])
    contacts = tuple(
        Contact(0.0, np.array([*(disc + (0.03 + TIP) * out), 0.018]), np.array([*-out, 0.0]), np.array([*out, 0.0]),
                disc + 0.03 * out, 1.0)
        for a in (0.0, 0.8, 1.6, 2.4, np.pi) if (out := np.array([np.cos(a), np.sin(a)])) is not None
    )  # fmt: skip
    outline = outline_of(contacts, TIP)
    neighbour = Candidate(1, outline.contour, 0.018, quality(outline), contacts)
    places = disc + np.array([[0.0, 0.0], [0.0, 0.030 + 0.5 * TIP], [0.0, 0.030 + 1.5 * TIP]])
    np.testing.assert_array_equal(taken_by((neighbour,), TIP, places), [True, True, False])
    unknown = replace(neighbour, quality=0.2)
    assert not taken_by((unknown,), TIP, places).any(), "it may be a part of the same object"
    touches = []
    for others in ((), (neighbour,)):
        world = world_of([box(0.1, 0.05), cylinder(0.03)], [(*CENTRE, 0), (*disc, 0)])
        plan = trace(
            touched_from(world, -1.5),
            world.tip_K_m,
            TIP,
            OrbitProbeParams().rule(),
            half_extent_m=INNER,
            elsewhere=partial(of_another, (neighbour,), TIP),
            taken=partial(taken_by, others, TIP),
        )
        result = drive(plan, world.execute)
        tips = np.array([c.tip_K_m[:2] for c in (*result.contacts, *result.outliers)])
        touches.append(int((np.abs(world.clearance(tips, 1)) < 1e-3).sum()))
    assert touches[1] < touches[0]


def test_what_is_too_long_for_one_object_is_two(world_of: WorldOf) -> None:
    """Contacts with two discs, the second taken for the first one's far end: those with one of them are kept."""
    for gap in (0.020, 0.030):
        apart = np.array([0.06 + gap, 0.0])
        state = TraceState.begin([], np.zeros(2), TIP, True, None)
        for middle, bearings in ((CENTRE, (1.0, 2.2, 3.1, 4.0, 5.1)), (CENTRE + apart, (-1.2, 0.0, 1.0))):
            for a in bearings:
                out = np.array([np.cos(a), np.sin(a), 0.0])
                tip = np.array([*middle, 0.018]) + (0.03 + TIP) * out
                state.raw.append(Contact(0.0, tip, -out, out, tip[:2] - TIP * out[:2], 1.0))
        assert state.keep_one(state.outline(), TraceParams())
        assert (len(state.raw), len(state.outliers)) == (5, 3)
        np.testing.assert_allclose(state.outline().centre_K_m, CENTRE, atol=1e-3)
        assert not state.keep_one(state.outline(), TraceParams())


def test_a_trace_that_drops_contacts_again_and_again_ends(world_of: WorldOf, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whenever a third contact was made, two are dropped as another object's, so the trace never has enough."""

    def keep_one(self: TraceState, outline: object, p: TraceParams) -> bool:
        dropping = len(self.raw) > 2
        if dropping:
            del self.raw[:-1]
            self.blocked.clear()
        return dropping

    monkeypatch.setattr(TraceState, "keep_one", keep_one)
    world, felt = world_of([cylinder(0.03)], [(*CENTRE, 0)]), []
    first = touched_from(world, 0.3)

    def execute(move: Move) -> MoveOutcome:
        outcome = world.execute(move)
        felt.append(outcome.contact is not None)
        return outcome

    result = drive(trace(first, world.tip_K_m, TIP, TraceParams(max_contacts=6), half_extent_m=INNER), execute)
    assert "other objects" in result.ended
    assert sum(felt) == 2 * 6


def test_the_end_of_an_unnoticed_contact_is_no_other_object(world_of: WorldOf) -> None:
    """The tool was pushed against the disc with too little force. When it leaves, the force changes inwards."""
    world = world_of([cylinder(0.03)], [(*CENTRE, 0)])
    first = touched_from(world, 0.7)
    places = []

    def execute(move: Move) -> MoveOutcome:
        outcome = world.execute(move)
        if places or move.kind != "step" or outcome.contact is not None:
            return outcome
        out = np.append(world.tip_K_m - centres_of(world)[0], 0.0)
        out /= np.linalg.norm(out)
        places.append(centres_of(world)[0] + (0.03 + TIP) * out[:2])
        world.tip_K_m = places[0]
        tip = np.array([*places[0], 0.018])
        turned = np.array([-out[1], out[0], 0.0])
        met = Contact(0.0, tip, turned, -out, tip[:2] + TIP * out[:2], 0.2)
        return replace(outcome, contact=met, path_K_m=np.vstack([outcome.path_K_m, places[0]]))

    result = drive(trace(first, world.tip_K_m, TIP, None, half_extent_m=INNER), execute)
    assert places
    assert result.outliers == ()
    assert result.contour is not None
    np.testing.assert_allclose(result.contour.centre_K_m, centres_of(world)[0], atol=3e-4)
