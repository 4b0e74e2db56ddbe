"""Panels of the page in the states before anything was compared or squeezed."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip("viser")

from glotouch_bt.report import read_run
from glotouch_bt.report.state import RunModel, Share
from glotouch_bt.view.page import panels
from tests.support.made_run import Made


def test_candidates_have_their_sizes_until_they_are_compared(whole: Made) -> None:
    record = read_run(whole.folder)
    model = RunModel.of(record)
    traced = [e.stamp_s for e in record.events if e.kind == "candidate"]
    state = model.state_at(traced[0])
    text = panels.posterior(state, "apple")
    assert f"62 × 62 × {1e3 * whole.candidates[0].height_m:.0f} mm" in text
    assert "candidate 1" not in text
    assert "Which one is" not in text
    compared = panels.posterior(replace(state, shares=(Share(0, 0.9), Share(None, 0.1))), "apple")
    assert " mm" not in compared
    assert "90.0 %" in compared


def test_without_an_image_the_gels_say_so_and_show_the_jaws(whole: Made) -> None:
    text = panels.gels(RunModel.of(read_run(whole.folder)).state_at(1.0))
    assert "no image" in text
    assert "<img" not in text
    assert "opening 80.0 mm · jaw force 5.0 N" in text
