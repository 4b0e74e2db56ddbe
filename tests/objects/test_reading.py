"""Reading a user's meshes: five formats give the same object; what is no object is refused with the reason."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.objects import Prepared, RefusedFile, mesh_files, prepare
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import load_mesh
from glotouch_bt.validation.fuzz.corrupt import corrupt_bytes

SIZE_M = np.array([0.05, 0.04, 0.06])
FORMATS = ("stl", "obj", "ply", "glb", "off")


def box(scale: float = 1.0) -> trimesh.Trimesh:
    return trimesh.creation.box(scale * SIZE_M)


def reason(path: Path, unit: str | None = None) -> str:
    made = prepare(path, unit)
    assert isinstance(made, RefusedFile), made
    return made.reason


def written(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize(("unit", "scale"), [(None, 1.0), ("m", 1.0), ("cm", 100.0), ("mm", 1e3), ("inch", 1 / 0.0254)])
@pytest.mark.parametrize("suffix", FORMATS)
def test_formats_and_units_give_the_same_object(suffix: str, unit: str | None, scale: float, tmp_path: Path) -> None:
    path = tmp_path / f"a.{suffix}"
    box(scale).export(path)
    made = prepare(path, unit)
    assert isinstance(made, Prepared), made
    size = SIZE_M[[0, 2, 1]] if suffix == "glb" else SIZE_M  # y is up in the file
    assert made.mesh.extents_m == pytest.approx(size, abs=1e-6)
    assert made.volume_m3 == pytest.approx(SIZE_M.prod(), rel=1e-4)
    written(tmp_path / "clean.stl", made.stl)
    clean = load_mesh(tmp_path / "clean.stl")
    assert clean.digest == made.mesh.digest
    assert clean.vertices_m[:, 2].min() == 0.0


@pytest.mark.parametrize(("scale", "unit"), [(1e3, "mm"), (1 / 0.0254 / 3, "inch")])
def test_an_implausible_size_names_the_unit_to_type(scale: float, unit: str, tmp_path: Path) -> None:
    box(scale).export(tmp_path / "a.stl")
    made = prepare(tmp_path / "a.stl")
    assert isinstance(made, RefusedFile)
    assert f"give --units {unit}" in made.reason
    assert isinstance(prepare(tmp_path / "a.stl", unit), Prepared)


def test_a_wrong_unit_names_the_right_one(tmp_path: Path) -> None:
    box().export(tmp_path / "a.stl")
    assert "give --units m" in reason(tmp_path / "a.stl", "mm")


def test_a_scene_is_one_object_if_its_parts_touch(tmp_path: Path) -> None:
    top = box()
    top.apply_translation((0.01, 0.03, 0.0))
    apart = box()
    apart.apply_translation((0.2, 0.0, 0.0))
    trimesh.Scene([box(), top]).export(tmp_path / "tower.glb")
    trimesh.Scene([box(), apart]).export(tmp_path / "two.glb")
    made = prepare(tmp_path / "tower.glb")
    assert isinstance(made, Prepared), made
    assert "joined 2 parts" in made.notes
    assert "holds 2 separate bodies; one object per file" in reason(tmp_path / "two.glb")


def glb(header: object) -> bytes:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<II", 2, 20 + len(text)) + struct.pack("<I", len(text)) + b"JSON" + text


NAN = "OFF\n4 4 0\n0 0 0\nnan 0 1\n0 1 0\n1 1 1\n3 0 1 2\n3 0 1 3\n3 0 2 3\n3 1 2 3\n"
BAD: list[tuple[str, str | bytes, str]] = [
    *((f"empty.{suffix}", b"", "") for suffix in FORMATS),
    *((f"text.{suffix}", "this is no mesh\n", "") for suffix in FORMATS),
    *((f"noise.{suffix}", np.random.default_rng(0).bytes(3000), "") for suffix in FORMATS),
    ("nan.off", NAN, "vertices that are not finite numbers"),
    ("points.ply", bytes(trimesh.PointCloud(np.eye(3)).export(file_type="ply")), "points or lines only"),
    ("one.obj", "v 0 0 0\nv .1 0 0\nv 0 .1 0\nf 1 2 3\n", "fewer than 4 triangles"),
    ("far.obj", "v 0 0 0\nv .1 0 0\nv 0 .1 0\n" + "f 1 2 9\n" * 5, ""),
    ("flat.obj", "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv .1 .1 0\n" + "f 1 2 3\nf 2 3 4\n" * 2, "measures 0.1 x 0.1 x 0 m"),
    ("many.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n", ""),
    ("bomb.glb", glb({"asset": {"version": "2.0"}, "accessors": [{"count": 10**12}]}), "declares more than"),
    ("odd.glb", glb([1, 2]), ""),
    ("odder.glb", glb({"accessors": [{"count": "many"}]}), ""),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "said"), BAD, ids=[b[0] for b in BAD])
def test_what_is_no_mesh_is_refused(name: str, content: str | bytes, said: str, tmp_path: Path) -> None:
    why = reason(written(tmp_path / name, content))
    assert said in why
    assert 5 < len(why) < 250
    assert str(tmp_path) not in why


def test_too_many_triangles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glotouch_bt.objects.files.MAX_TRIANGLES", 11)
    box().export(tmp_path / "a.ply")
    assert "has 12 triangles; at most 11 are allowed: simplify it" in reason(tmp_path / "a.ply")


def test_the_files_of_a_folder(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such folder or file"):
        mesh_files(tmp_path / "gone")
    with pytest.raises(BadInput, match=r"holds no mesh \(formats: .stl, .obj, .ply, .glb, .off\)"):
        mesh_files(tmp_path)
    for name in ("a.STL", "b.obj", "readme.txt"):
        (tmp_path / name).touch()
    assert list(mesh_files(tmp_path)) == ["a", "b"]
    assert list(mesh_files(tmp_path / "b.obj")) == ["b"]
    (tmp_path / "b.ply").touch()
    with pytest.raises(BadInput, match=r"b.obj and b.ply are two files for one object"):
        mesh_files(tmp_path)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("suffix", FORMATS)
def test_a_corrupted_file_is_a_sound_object_or_refused(suffix: str, seed: int, tmp_path: Path) -> None:
    """Nothing else is raised, and what is accepted loads from the clean folder as it was shown."""
    rng = np.random.default_rng(seed)
    exported = trimesh.creation.icosphere(2, 0.03).export(file_type=suffix)
    data = exported.encode() if isinstance(exported, str) else bytes(exported)
    made = prepare(written(tmp_path / f"a.{suffix}", corrupt_bytes(data, rng)))
    if isinstance(made, RefusedFile):
        assert made.reason
        return
    clean = load_mesh(written(tmp_path / "clean.stl", made.stl))
    assert clean.digest == made.mesh.digest
    assert clean.as_trimesh().is_watertight
