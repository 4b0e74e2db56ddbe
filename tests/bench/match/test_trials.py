"""Decisions of a layout and the figures made of them, worked out by hand."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from glotouch_bt.bench.match.shapes import symmetries_rad, twins
from glotouch_bt.bench.match.summary import calibration, column_decisions, loss_matrix, separation, summarise
from glotouch_bt.bench.match.trials import decide, pose_errors, signed_margin
from glotouch_bt.perception.recognition import Match
from glotouch_bt.robot.scene import load_folder
from tests.bench.match.conftest import a_layout, by_size
from tests.support import shapes

HERE, THERE = Path("here"), Path("there")


def test_every_kind_of_decision(made_up):
    found = decide(a_layout(), HERE, THERE, ["likelihood"])
    kinds = [(t["kind"], t["target"], t["best_object"], t["right"], t["accepted"]) for t in found.trials]
    assert kinds == [
        ("present", "large", "large", True, True),
        ("absent", "large", "middle", False, False),
        ("present", "middle", "middle", True, True),
        ("absent", "middle", "small", False, False),
        ("present", "small", "small", True, True),
        ("absent", "small", "middle", False, False),
        ("stranger", "small", "small", False, True),
        ("stranger", "middle", "middle", False, True),
        ("stranger", "large", "large", False, True),
    ]
    assert [t["margin"] for t in found.trials[::2][:3]] == pytest.approx([2.0, 2.0, 2.0])
    assert found.trials[0]["position_error_mm"] == pytest.approx(5.0)
    assert found.trials[0]["yaw_error_deg"] == pytest.approx(np.rad2deg(0.1))
    assert math.isnan(found.trials[1]["margin"])
    assert len(found.pairs) == 2 * 9
    apart = summarise(found.trials, found.pairs, [], ["likelihood"])["methods"]["likelihood"]["apart"]
    assert {name: f["right_and_accepted"]["n"] for name, f in apart.items()} == {"no_twin": 1, "twin": 2}


def test_the_same_solid_is_no_stranger(made_up):
    assert {t["kind"] for t in decide(a_layout(), HERE, HERE, ["likelihood"]).trials} == {"present", "absent"}


def test_an_object_that_was_not_squeezed_is_counted_apart(made_up):
    layout = a_layout(names=("small", None), sizes=(0.04, 0.081))
    trials = decide(layout, HERE, None, ["likelihood"]).trials
    kinds = {(t["target"], t["kind"]): t for t in trials}
    assert set(kinds) == {("large", "untouched"), ("middle", "untouched"), ("small", "present"), ("small", "absent")}
    assert kinds["large", "untouched"]["accepted"]
    assert not kinds["large", "untouched"]["right"]
    figures = summarise(trials, decide(layout, HERE, None, ["likelihood"]).pairs, [], ["likelihood"])["methods"]
    assert figures["likelihood"]["row_top1"]["rate"] == 1.0
    assert figures["likelihood"]["row_top1_untouched_wrong"]["rate"] == pytest.approx(1 / 3)


def test_an_object_found_twice_is_right_either_way_and_absent_without_both(made_up):
    layout = a_layout(names=("small", "small", "large"), sizes=(0.04, 0.041, 0.08))
    trials = decide(layout, HERE, None, ["likelihood"]).trials
    absent = [t for t in trials if t["kind"] == "absent" and t["target"] == "small"]
    assert [(t["candidates"], t["best_object"]) for t in absent] == [(1, "large")]
    assert all(t["right"] for t in trials if t["kind"] == "present")


def test_nothing_squeezed_gives_no_decision(made_up):
    assert decide(a_layout(names=()), HERE, THERE, ["likelihood"]).trials == []


def test_margin_is_negative_where_a_wrong_one_leads():
    ranking = by_size(SimpleNamespace(name="small"), [t.touchset for t in a_layout().touched])
    assert signed_margin(ranking, {0}) == pytest.approx(2.0)
    assert signed_margin(ranking, {1}) == pytest.approx(-2.0)
    assert math.isnan(signed_margin(ranking, {0, 1, 2}))


def a_match(yaw, xy=(0.0, 0.0)):
    return Match(0, 0.1, {}, None, (*xy, yaw), 3.0)


def test_symmetries_of_solids(tmp_path):
    """A jar is one of revolution, a cross has four, a roofed block two, an L one; yaw errors are up to them."""
    shapes.write(tmp_path, ["jar", "cross", "house", "l_block"])
    meshes = {m.name: m for m in load_folder(tmp_path)}
    turns = {n: np.rad2deg(symmetries_rad(m)).round(6).tolist() for n, m in meshes.items()}
    assert turns["jar"] == [5.0 * k for k in range(72)]
    assert (turns["cross"], turns["house"], turns["l_block"]) == ([0, 90, 180, 270], [0, 180], [0])
    off = pose_errors(a_match(np.deg2rad(187.0)), (0.001, 0.0, 0.0), meshes["house"])
    assert off == pytest.approx({"position_error_mm": 1.0, "yaw_error_deg": 7.0})
    assert pose_errors(a_match(np.deg2rad(-178.0)), (0, 0, np.deg2rad(178.0)), meshes["l_block"])[
        "yaw_error_deg"
    ] == pytest.approx(4.0)
    assert math.isnan(pose_errors(a_match(0.0), None, meshes["jar"])["yaw_error_deg"])


def test_twins_are_turned_copies_and_waists_of_a_few_millimetres(tmp_path):
    solids = {"block": trimesh.creation.box((0.06, 0.04, 0.05)), "taller": trimesh.creation.box((0.06, 0.04, 0.06))}
    solids["turned"] = solids["block"].copy()
    solids["turned"].apply_transform(trimesh.transformations.rotation_matrix(math.radians(40.0), (0, 0, 1)))
    solids["wider"] = trimesh.creation.box((0.061, 0.041, 0.05))
    for name, solid in solids.items():
        solid.export(tmp_path / f"{name}.stl")
    meshes = {m.name: m for m in load_folder(tmp_path)}
    found = {name: twins(meshes["block"], m) for name, m in meshes.items() if name != "block"}
    assert found == {"taller": False, "turned": True, "wider": True}


def a_trial(kind, right, p_best, p_absent, seed=0, loss=1.0):
    return {"kind": kind, "right": right, "p_best": p_best, "p_absent": p_absent, "seed": seed, "best_loss": loss}


def test_the_likeliest_answer_may_be_none_of_them():
    """.9 right, .8 "none" of a present target wrong, .7 "none" of an absent one right, .6 of an absent one wrong."""
    there = [a_trial("present", True, 0.9, 0.1), a_trial("present", True, 0.2, 0.8)]
    gone = [a_trial("absent", False, 0.3, 0.7), a_trial("absent", False, 0.6, 0.4)]
    found = calibration(there + gone)
    assert found["value"] == pytest.approx((0.1 + 0.8 + 0.3 + 0.6) / 4)
    wrong_and_absent = calibration([a_trial("present", False, 0.2, 0.8)])
    assert wrong_and_absent["bins"][0]["right"] == 0.0


def test_separation_by_probability_and_by_loss():
    there = [a_trial("present", True, 0.9, p, s, x) for s, (p, x) in enumerate([(0.1, 1.0), (0.3, 2.0)])]
    gone = [a_trial("absent", False, 0.1, p, s, x) for s, (p, x) in enumerate([(0.2, 3.0), (0.9, math.inf)])]
    found = separation(there, gone)
    assert found["probability"]["value"] == pytest.approx(3 / 4)
    assert found["loss"]["value"] == 1.0
    assert found["probability"]["layouts"] == 2


def a_pair(target, obj, loss, seed=0, candidate=0):
    return {"target": target, "object": obj, "loss": loss, "seed": seed, "candidate": candidate, "stranger": False}


def test_columns_and_matrix():
    pairs = [a_pair("a", "a", 1.0), a_pair("b", "a", 2.0), a_pair("a", "b", 0.5, 0, 1), a_pair("b", "b", 0.7, 0, 1)]
    pairs += [a_pair("a", "b", 1.5, 1, 0), a_pair("b", "b", math.inf, 1, 0), a_pair("a", None, 0.1, 1, 1)]
    pairs += [a_pair("a", "a", math.inf, 2, 0), a_pair("b", "a", math.inf, 2, 0)]
    assert [c["right"] for c in column_decisions(pairs)] == [True, False, False, False]
    assert loss_matrix(pairs) == [[1.0, 1.0], [2.0, 0.7]]
