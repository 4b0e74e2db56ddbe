"""Loading STL files: what is one clear solid loads the same however it was written; what is not is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import load_folder, load_mesh, repaired_solid, sound_solid

SIZE = np.array([0.06, 0.04, 0.05])


def block(middle_m=(0.0, 0.0, 0.025)) -> trimesh.Trimesh:
    solid = trimesh.creation.box(SIZE)
    solid.apply_translation(middle_m)
    return solid


def write(path: Path, triangles_m: np.ndarray) -> Path:
    """A binary STL of exactly these triangles (n, 3, 3)."""
    n = len(triangles_m)
    record = np.zeros(n, dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["corners"] = triangles_m
    path.write_bytes(bytes(80) + np.uint32(n).tobytes() + record.tobytes())
    return path


@pytest.mark.parametrize("middle_m", [(0.0, 0.0, 0.0), (0.3, -0.2, 7.0), (-40.0, 25.0, -3.0)])
def test_the_files_origin_does_not_matter(middle_m, tmp_path: Path) -> None:
    mesh = load_mesh(write(tmp_path / "block.stl", block(middle_m).triangles))
    rounding = np.abs(middle_m).max() * 1.2e-7 + 1e-6
    assert mesh.vertices_m.min(axis=0) == pytest.approx([-0.03, -0.02, 0.0], abs=2 * rounding)
    assert mesh.vertices_m.max(axis=0) == pytest.approx([0.03, 0.02, 0.05], abs=2 * rounding)
    assert mesh.as_trimesh().volume == pytest.approx(SIZE.prod(), rel=1e-3)


def test_text_and_binary_and_any_case_of_the_suffix(tmp_path: Path) -> None:
    (tmp_path / "text.STL").write_text(block().export(file_type="stl_ascii"))
    block().export(tmp_path / "binary.stl")
    text, binary = sorted(load_folder(tmp_path), key=lambda m: m.name, reverse=True)
    assert np.ptp(text.vertices_m, axis=0) == pytest.approx(np.ptp(binary.vertices_m, axis=0), abs=1e-6)


def test_faces_turned_over_are_turned_back(tmp_path: Path) -> None:
    triangles = block().triangles.copy()
    triangles[[1, 4, 5, 9]] = triangles[[1, 4, 5, 9]][:, ::-1]
    for name, written in (("some", triangles), ("all", block().triangles[:, ::-1])):
        solid = load_mesh(write(tmp_path / f"{name}.stl", written)).as_trimesh()
        assert solid.is_winding_consistent
        assert solid.volume == pytest.approx(SIZE.prod(), rel=1e-5)


def test_corners_written_twice_and_collapsed_triangles(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    triangles = block().triangles + rng.uniform(-4e-7, 4e-7, (12, 3, 3))
    sliver = np.repeat(triangles[:1, :1], 3, axis=1)
    mesh = load_mesh(write(tmp_path / "sloppy.stl", np.concatenate([triangles, sliver])))
    assert (len(mesh.vertices_m), len(mesh.faces)) == (8, 12)


def test_a_hollow_and_overlapping_shells_are_one_object(tmp_path: Path) -> None:
    inner = trimesh.creation.box(0.6 * SIZE)
    inner.apply_translation((0, 0, 0.025))
    hollow = load_mesh(write(tmp_path / "a.stl", np.concatenate([block().triangles, inner.triangles[:, ::-1]])))
    assert hollow.as_trimesh().volume == pytest.approx(SIZE.prod() * (1 - 0.6**3), rel=1e-5)
    overlapping = np.concatenate([block().triangles, block((0.03, 0.01, 0.03)).triangles])
    assert load_mesh(write(tmp_path / "b.stl", overlapping)).extents_m == pytest.approx([0.09, 0.05, 0.055], abs=1e-6)


@pytest.mark.parametrize(
    ("triangles", "words"),
    [
        (block().triangles[:-1], "not watertight"),
        (np.concatenate([block().triangles, block((0.08, 0.0, 0.025)).triangles]), "2 separate bodies"),
        (1000 * block().triangles, r"\(in millimetres\? then scale it by 0\.001 to 0\.06 m\)"),
        (
            block().triangles / 0.0254,
            r"\(in centimetres\? .* to 0\.0236 m; in inches\? then scale it by 0\.0254 to 0\.06 m\)",
        ),
        (8 * block().triangles, r"at most 0\.3 m \(in inches\? then scale it by 0\.0254 to 0\.0122 m\)"),
        (600 * block((0, 0, 0)).triangles * (1, 1, 1e-3), r"at most 0\.3 m$"),
        (0.05 * block().triangles, "thick"),
        (block().triangles[:3], "fewer than 4"),
        (np.where(np.arange(12)[:, None, None] == 3, np.nan, block().triangles), r"not (finite|watertight)"),
    ],
)
def test_what_cannot_be_used_is_named(triangles, words: str, tmp_path: Path) -> None:
    path = write(tmp_path / "bad.stl", triangles)
    with pytest.raises(BadInput, match=words) as caught:
        load_mesh(path)
    assert "bad.stl" in str(caught.value)
    assert sound_solid(path.read_bytes()) is None


@pytest.mark.parametrize("solid", [block(), block((0.3, -0.2, 7.0)), trimesh.creation.icosphere(3, 0.05)])
def test_the_quick_check_accepts_a_closed_solid(solid: trimesh.Trimesh, tmp_path: Path) -> None:
    path = write(tmp_path / "good.stl", solid.triangles)
    assert sound_solid(path.read_bytes()) is not None
    load_mesh(path)


@pytest.mark.parametrize("solid", [block(), trimesh.creation.icosphere(3, 0.05), trimesh.creation.torus(0.04, 0.012)])
def test_a_sound_solid_is_read_as_trimesh_reads_it(solid: trimesh.Trimesh, tmp_path: Path) -> None:
    data = write(tmp_path / "good.stl", solid.triangles).read_bytes()
    quick = sound_solid(data)
    assert quick is not None
    for found, expected in zip(quick, repaired_solid(Path("good.stl"), data), strict=True):
        assert np.array_equal(found, expected)


def test_the_quick_check_leaves_doubtful_solids_to_load_mesh(tmp_path: Path) -> None:
    turned = block().triangles.copy()
    turned[3] = turned[3][::-1]
    overlapping = np.concatenate([block().triangles, block((0.03, 0.01, 0.03)).triangles])
    for triangles in (turned, overlapping):
        path = write(tmp_path / "doubtful.stl", triangles)
        assert sound_solid(path.read_bytes()) is None
        load_mesh(path)


@pytest.mark.parametrize(
    "content", [b"", b"solid nothing", b"\x00" * 50, b"\x00" * 80 + b"\xff\xff\xff\xff" + b"\x00" * 9]
)
def test_rubbish_is_bad_input(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "rubbish.stl").write_bytes(content)
    with pytest.raises(BadInput, match=r"rubbish\.stl"):
        load_mesh(tmp_path / "rubbish.stl")
    with pytest.raises(BadInput, match="no such"):
        load_mesh(tmp_path / "missing.stl")
