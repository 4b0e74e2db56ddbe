"""Folders of objects from a stranger: names, twins, and STL files that are broken, huge or nearly too small."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import ObjectSet, load_folder, load_mesh, meshes, sound_solid, stl_files, twins_of
from glotouch_bt.robot.scene.placement import place_objects
from glotouch_bt.robot.scene.streams import stream

BLOCK = trimesh.creation.box((0.05, 0.04, 0.06))


def test_two_files_for_one_object_are_refused(tmp_path: Path) -> None:
    BLOCK.export(tmp_path / "aaa.stl")
    (tmp_path / "aaa.STL").write_bytes((tmp_path / "aaa.stl").read_bytes())
    for use in (stl_files, load_folder):
        with pytest.raises(BadInput, match=r"aaa\.STL and aaa\.stl are two files for one object"):
            use(tmp_path)


def test_a_suffix_in_capitals_is_one(tmp_path: Path) -> None:
    (tmp_path / "a.STL").write_bytes(BLOCK.export(file_type="stl"))
    assert [m.name for m in load_folder(tmp_path, ("a",))] == ["a"]


@pytest.mark.parametrize("name", ["a\x1b[31m", "a\nb", "\u202egpj", "a\x7f", "\udc80"])
def test_a_name_that_cannot_be_seen_is_refused(name: str, tmp_path: Path) -> None:
    BLOCK.export(tmp_path / "a.stl")
    (tmp_path / "a.stl").rename(tmp_path / f"{name}.stl")
    with pytest.raises(BadInput, match="rename the file"):
        stl_files(tmp_path)


def test_twins_are_named(tmp_path: Path) -> None:
    for name in ("one", "two", "three"):
        BLOCK.export(tmp_path / f"{name}.stl")
    data = bytearray((tmp_path / "two.stl").read_bytes())
    data[:5] = b"other"  # the text at the head says nothing about the shape
    (tmp_path / "two.stl").write_bytes(data)
    trimesh.creation.box((0.05, 0.04, 0.05)).export(tmp_path / "three.stl")
    assert twins_of("one", ObjectSet(folder=tmp_path)) == ("two",)
    assert twins_of("three", ObjectSet(folder=tmp_path)) == ()
    assert twins_of("one", ObjectSet(folder=tmp_path, names=("one", "three"))) == ()
    assert twins_of(str(tmp_path / "one.stl"), ObjectSet(folder=tmp_path)) == ("two",)


BROKEN = (
    b"solid \xff\xfe\nfacet normal 0 0 0\nouter loop\nvertex \xff 0 0\nendsolid\n",
    b"solid x\nvertex secret 0 0\nvertex 0 0 0\nvertex 0 0 0\nendsolid\n",
    b"endsolid solid",
    b"\xff" * 500,
    b"\x00" * 80 + (5).to_bytes(4, "little") + b"\x00" * 200,
)


@pytest.mark.parametrize("content", BROKEN)
def test_a_broken_file_is_told_in_a_plain_sentence(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(BadInput) as told:
        load_mesh(tmp_path / "a.stl")
    assert str(told.value).startswith(f"{tmp_path}/a.stl: ")
    assert not any(word in str(told.value) for word in ("module", "secret", "Error", "codec"))


@pytest.mark.parametrize(("size_m", "fits"), [(0.005, True), (0.0049999999, True), (0.004999, False), (0.0049, False)])
def test_the_least_size_is_compared_as_it_is_shown(size_m: float, fits: bool, tmp_path: Path) -> None:
    trimesh.creation.box((0.05, 0.04, size_m)).export(tmp_path / "a.stl")
    if fits:
        load_mesh(tmp_path / "a.stl")
        return
    with pytest.raises(BadInput, match=f"is only {size_m} m thick; at least 0.005 m is needed"):
        load_mesh(tmp_path / "a.stl")


@pytest.mark.parametrize("binary", [True, False])
def test_too_many_triangles_are_refused_before_they_are_read(
    binary: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(meshes, "MAX_TRIANGLES", 11)
    (tmp_path / "a.stl").write_bytes(
        BLOCK.export(file_type="stl") if binary else BLOCK.export(file_type="stl_ascii").encode()
    )
    assert sound_solid((tmp_path / "a.stl").read_bytes()) is None
    with pytest.raises(BadInput, match="has 12 triangles; at most 11 are allowed"):
        load_mesh(tmp_path / "a.stl")


def test_five_million_triangles_are_refused_at_once(tmp_path: Path) -> None:
    count = 5_000_000
    with (tmp_path / "a.stl").open("wb") as file:
        file.write(bytes(80) + count.to_bytes(4, "little"))
        file.truncate(84 + 50 * count)
    began = time.monotonic()
    with pytest.raises(BadInput, match="is larger than 64000000 bytes"):
        load_mesh(tmp_path / "a.stl")
    assert time.monotonic() - began < 5.0


def test_many_shells_are_refused_at_once(tmp_path: Path) -> None:
    """Each is a solid of its own; comparing all pairs would take all the memory."""
    small = trimesh.creation.box((0.001, 0.001, 0.001)).triangles
    places = np.stack(np.meshgrid(*[np.arange(13) * 0.01] * 3), axis=-1).reshape(-1, 1, 1, 3)
    trimesh.Trimesh(**trimesh.triangles.to_kwargs((small + places).reshape(-1, 3, 3))).export(tmp_path / "a.stl")
    with pytest.raises(BadInput, match="holds 2197 separate bodies"):
        load_mesh(tmp_path / "a.stl")


def test_objects_that_cannot_fit_are_refused_at_once(tmp_path: Path) -> None:
    BLOCK.export(tmp_path / "a.stl")
    mesh = load_mesh(tmp_path / "a.stl")
    began = time.monotonic()
    with pytest.raises(BadInput, match="25 objects do not fit into the container: no place found for 'a'"):
        place_objects([mesh] * 25, (0.30, 0.40), 0.030, 0.030, stream(0, "layout"))
    assert time.monotonic() - began < 2.0
