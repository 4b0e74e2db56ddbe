"""The map and the 3D view draw free outlines by their corners, but no faulty outlines and no forgotten candidates."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glotouch_bt.mission.record.mcap_scene import event_scene
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.report import read_run
from glotouch_bt.report.sections.map import candidates, contour_of

CORNERS = [[0.02, 0.0], [0.0, 0.03], [-0.02, 0.0]]


def candidate(**more: Any) -> dict[str, Any]:
    contour = {"kind": "box", "centre_K_m": [0.0, 0.01], "size_m": [0.04, 0.03], "yaw_rad": 0.0, "rms_m": 1e-4}
    return {"index": 0, "height_m": 0.05, "contour": contour | more}


def drawn(c: dict[str, Any]) -> list[tuple[float, float]]:
    """The polyline of the scene, or []."""
    messages = list(event_scene("candidate", 0, {"candidate": c}))
    if not messages:
        return []
    (line,) = json.loads(messages[0][1])["entities"][0]["lines"]
    assert {p["z"] for p in line["points"]} == {0.05}
    return [(p["x"], p["y"]) for p in line["points"]]


def test_corners_closed() -> None:
    c = candidate(family="free", boundary_K_m=CORNERS)
    contour = contour_of(c)
    assert contour is not None
    np.testing.assert_array_equal(contour.outline_K_m(), [*CORNERS, CORNERS[0]])
    np.testing.assert_allclose(drawn(c), [*CORNERS, CORNERS[0]])


@pytest.mark.parametrize(
    "more", [{}, {"family": "rectangle", "boundary_K_m": []}], ids=["before families", "rectangle"]
)
def test_others_as_their_kind_says(more: dict[str, Any]) -> None:
    contour = contour_of(candidate(**more))
    assert contour is not None
    assert contour.family == "rectangle"
    np.testing.assert_allclose(drawn(candidate(**more)), contour.outline_K_m(), atol=1e-12)


@pytest.mark.parametrize("corners", [None, [], [[0.0, 0.0]], [[0, 0, 0]] * 3, [[0.0, "x"]] * 3, 7])
def test_what_is_no_outline_is_left_out(corners: Any) -> None:
    c = candidate(family="free", boundary_K_m=corners)
    assert contour_of(c) is None
    assert drawn(c) == []


def test_a_forgotten_candidate_is_drawn_no_more(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", {"mission": "m"}) as record:
        for index in range(3):
            record.event("candidate", 1.0 + index, {"candidate": candidate() | {"index": index}})
        record.event("forgotten", 5.0, {"candidates": [0, 2]})
        record.event("candidate", 6.0, {"candidate": candidate() | {"index": 2}})
    assert [c["index"] for c in candidates(read_run(tmp_path))] == [1, 2]
    ((topic, scene),) = event_scene("forgotten", 0, {"candidates": [0, 2]})
    assert topic == "/scene"
    assert [d["id"] for d in json.loads(scene)["deletions"]] == ["candidate 0", "candidate 2"]
    assert not list(event_scene("forgotten", 0, {"candidates": [None]}))
