"""Files of touched objects: written whole, read with suspicion."""

import json

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception import read_touched, touched_name, touched_path, write_touched
from glotouch_bt.perception.recognition import PadSpec, TouchedObject, encounter_of, touched_model
from glotouch_bt.perception.touched_files import MAX_ENCOUNTERS
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene.meshes import load_mesh
from tests.support.acquisition import NOMINAL, acquire


@pytest.fixture(scope="module")
def felt(tmp_path_factory):
    file = tmp_path_factory.mktemp("stl") / "can.stl"
    trimesh.creation.cylinder(0.026, 0.055, sections=64).export(file)
    touchset, _ = acquire(load_mesh(file), (0.0, 0.0, 0.0), NOMINAL, np.random.default_rng(0), 0)
    return TouchedObject("can", (encounter_of(touchset, PadSpec()),))


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


def test_what_is_read_is_what_was_written(felt) -> None:
    path = write_touched(felt)
    assert path == touched_path("can")
    again = read_touched("can")
    a, b = (touched_model(x, PadSpec()) for x in (felt, again))
    np.testing.assert_array_equal(a.width_m, b.width_m)
    np.testing.assert_array_equal(a.images, b.images)
    assert a.digest == b.digest
    assert [p.name for p in path.parent.iterdir()] == ["can.json"], "no part is left"


def test_only_the_newest_encounters_are_kept(felt) -> None:
    write_touched(TouchedObject("can", felt.encounters * (MAX_ENCOUNTERS + 2)))
    assert len(read_touched("can").encounters) == MAX_ENCOUNTERS


def test_a_name_that_was_never_remembered_says_what_to_do(felt) -> None:
    write_touched(felt)
    with pytest.raises(BadInput, match=r"remembered: can\).*glotouch run remember --set name=mug"):
        read_touched("mug")


@pytest.mark.parametrize("name", ["", "../etc", "a/b", "a b", "x" * 65])
def test_a_name_is_no_path(name: str) -> None:
    with pytest.raises(BadInput, match="cannot name"):
        touched_path(name)


def test_targets_are_told_apart_by_their_prefix() -> None:
    assert [touched_name(t) for t in ("touched:mug", "mug", "touched.stl")] == ["mug", "", ""]


def _set(path: str, value: object):
    def change(content) -> None:
        *way, last = path.split("/")
        for key in way:
            content = content[int(key) if key.isdigit() else key]
        content[last] = value

    return change


@pytest.mark.parametrize(
    "change",
    [
        _set("version", 2),
        _set("extra", 1),
        _set("encounters", []),
        _set("encounters/0/height_m", float("nan")),
        _set("encounters/0/height_m", 40.0),
        _set("encounters/0/outline/boundary_m", [[0.0, 0.0]]),
        _set("encounters/0/outline/family", "free"),
        _set("encounters/0/closures", []),
        _set("encounters/0/closures/0/left", [0.1] * 34),
        _set("encounters/0/closures/0/left", [1e9] * 35),
        _set("encounters/0/closures/0/width_m", "wide"),
    ],
)
def test_a_changed_file_is_refused(felt, change) -> None:
    path = write_touched(felt)
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(BadInput, match=str(path)):
        read_touched("can")


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"\xff\xfe", b"[" * 100_000])
def test_a_damaged_file_is_refused(felt, data: bytes) -> None:
    path = write_touched(felt)
    path.write_bytes(data)
    with pytest.raises(BadInput, match=str(path)):
        read_touched("can")


def test_a_link_is_not_followed(felt, tmp_path) -> None:
    path = write_touched(felt)
    path.rename(tmp_path / "elsewhere.json")
    path.symlink_to(tmp_path / "elsewhere.json")
    with pytest.raises(BadInput, match="link"):
        read_touched("can")
