"""Convex parts keep notches and cover the shape; the cache survives damage and never returns wrong data."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from glotouch_backends.mujoco.hulls import decompose as room
from glotouch_backends.mujoco.hulls.bulge import bulge_m, depth_inside_m, surface_distance_m
from glotouch_backends.mujoco.hulls.convex_parts import trimmed_hull
from glotouch_backends.mujoco.hulls.decompose import KEY, MAX_VERTICES, load_hulls
from glotouch_backends.mujoco.hulls.feet import FOOT_PROTRUSION_M, FOOT_RADIUS_M, MAX_FEET, foot_centres
from glotouch_backends.mujoco.hulls.files import Parts, decode, encode, read_parts, user_folder
from glotouch_bt.robot.scene import Mesh, load_folder, load_mesh


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return user_folder()


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Lines that were logged."""
    lines: list[str] = []
    monkeypatch.setattr(room._log, "warning", lines.append)
    return lines


def as_mesh(solid: trimesh.Trimesh, folder: Path, name: str) -> Mesh:
    path = folder / f"{name}.stl"
    solid.export(path)
    return load_mesh(path)


def extruded(corners_mm: list[tuple[float, float]], height_mm: float) -> trimesh.Trimesh:
    """A prism over a polygon given corner by corner, fanned from its first corner (which must see all others)."""
    n = len(corners_mm)
    flat = np.array(corners_mm) * 1e-3
    low, high = np.c_[flat, np.zeros(n)], np.c_[flat, np.full(n, height_mm * 1e-3)]
    fan = [(0, i, i + 1) for i in range(1, n - 1)]
    faces = [(a, c, b) for a, b, c in fan] + [(a + n, b + n, c + n) for a, b, c in fan]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, j + n), (i, j + n, i + n)]
    return trimesh.Trimesh(np.concatenate([low, high]), faces)


def l_shape() -> trimesh.Trimesh:
    return extruded([(20, 20), (20, 60), (0, 60), (0, 0), (60, 0), (60, 20)], 30)


def ring() -> trimesh.Trimesh:
    return trimesh.creation.annulus(r_min=0.015, r_max=0.03, height=0.025, sections=24)


def union_volume_m3(parts: tuple[np.ndarray, ...], lower: np.ndarray, upper: np.ndarray) -> float:
    points = np.random.default_rng(0).uniform(lower, upper, (20_000, 3))
    return float((depth_inside_m(points, parts) > 0).mean() * np.prod(upper - lower))


@pytest.mark.parametrize(
    ("make", "open_points_m"),
    [
        (l_shape, [(0.040, 0.040, 0.015), (0.023, 0.023, 0.015), (0.057, 0.023, 0.001)]),
        (ring, [(0.0, 0.0, 0.012), (0.012, 0.0, 0.012), (0.0, -0.012, 0.001)]),
    ],
)
def test_notches_and_holes_stay_open(make, open_points_m, tmp_path: Path) -> None:
    mesh = as_mesh(make(), tmp_path, "shape")
    hulls = load_hulls(mesh)
    assert depth_inside_m(np.array(open_points_m), hulls).max() < 0  # outside every hull
    assert depth_inside_m(mesh.vertices_m, hulls).min() > -2e-4  # every corner is kept
    lower, upper = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    assert union_volume_m3(hulls, lower, upper) == pytest.approx(mesh.as_trimesh().volume, rel=0.05)
    assert np.percentile(bulge_m(mesh, hulls, 3000), 95) < 1e-3
    assert 2 <= len(hulls) <= 32


def test_second_load_equals_the_first_byte_for_byte(tmp_path: Path, cache: Path, said: list[str]) -> None:
    mesh = as_mesh(l_shape(), tmp_path, "shape")
    first = load_hulls(mesh)
    assert any("cutting" in line for line in said)
    file = cache / f"{mesh.digest}.npz"
    stored = file.read_bytes()
    said.clear()
    second = load_hulls(mesh)
    assert said == []
    assert [h.tobytes() for h in first] == [h.tobytes() for h in second]
    assert file.read_bytes() == stored
    assert [p.name for p in cache.iterdir() if not p.name.endswith(".lock")] == [file.name]  # no temporary left
    assert not first[0].flags.writeable


def test_cutting_is_deterministic(tmp_path: Path) -> None:
    mesh = as_mesh(l_shape(), tmp_path, "shape")
    assert encode(KEY, room.decompose(mesh)) == encode(KEY, room.decompose(mesh))


def box(tmp_path: Path, size: float = 0.04) -> Mesh:
    return as_mesh(trimesh.creation.box((size, size, 0.04)), tmp_path, "box")


def test_a_convex_solid_is_one_hull_of_its_own_corners(tmp_path: Path) -> None:
    mesh = box(tmp_path)
    (hull,) = load_hulls(mesh)
    assert len(hull) == 8
    assert surface_distance_m(hull, mesh).max() < 1e-7


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace CoACD: a convex solid is its own single part."""
    monkeypatch.setattr(room, "_run_coacd", lambda mesh, *_: [mesh.vertices_m])


DAMAGE = ("truncated", "garbage", "empty", "other key", "wrong counts", "not finite", "folder", "beyond the mesh",
          "not covering the mesh", "flat", "a bomb", "objects")  # fmt: skip


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_replaced(damage: str, tmp_path: Path, cache: Path, said: list[str]) -> None:
    mesh = box(tmp_path)
    load_hulls(mesh)
    file = cache / f"{mesh.digest}.npz"
    good = file.read_bytes()
    hull = load_hulls(mesh)[0]
    match damage:
        case "truncated":
            file.write_bytes(good[: len(good) // 2])
        case "garbage":
            file.write_bytes(bytes(range(256)) * 20)
        case "empty":
            file.write_bytes(b"")
        case "other key":
            file.write_bytes(encode("older parameters", Parts((2 * hull,))))
        case "wrong counts":
            file.write_bytes(encode(KEY, Parts((hull, hull[:3]))))
        case "not finite":
            file.write_bytes(encode(KEY, Parts((hull * np.nan,))))
        case "beyond the mesh":
            file.write_bytes(encode(KEY, Parts((3 * hull,))))
        case "not covering the mesh":
            file.write_bytes(encode(KEY, Parts((0.2 * hull,))))
        case "flat":
            file.write_bytes(encode(KEY, Parts((hull * [1, 1, 0],))))
        case "a bomb":
            np.savez_compressed(file, vertices=np.zeros((10**7, 3)), counts=[10**7], key=KEY, note="")
        case "objects":
            np.savez_compressed(file, vertices=np.array([None]), counts=[4], key=KEY, note="")
        case "folder":
            file.unlink()
            file.mkdir()
    healed = load_hulls(mesh)
    assert healed[0].tobytes() == hull.tobytes()
    if damage != "folder":
        assert file.read_bytes() == good
    else:
        assert "cannot be kept" in said[-1]


@pytest.mark.parametrize("offset", range(0, 1000, 37))
def test_a_flipped_byte_never_raises(offset: int, tmp_path: Path) -> None:
    """The zip's checksum finds it, or the byte has no effect."""
    hull = box(tmp_path).vertices_m
    content = bytearray(encode(KEY, Parts((hull,))))
    content[offset % len(content)] ^= 0xFF
    found = decode(bytes(content), KEY)
    assert found is None or np.allclose(found.hulls[0], hull, atol=1e-8)


@pytest.mark.usefixtures("quick")
def test_another_shape_has_another_file(tmp_path: Path, cache: Path) -> None:
    first, second = box(tmp_path, 0.04), box(tmp_path, 0.05)
    load_hulls(first)
    load_hulls(second)
    assert {p.stem for p in cache.glob("*.npz")} == {first.digest, second.digest}


def test_failed_cutting_falls_back_to_coarse_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    mesh = as_mesh(l_shape(), tmp_path, "shape")
    monkeypatch.setattr(room, "FINE", room.Attempt({"threshold": "not a number"}, 30.0))
    hulls = load_hulls(mesh)
    assert any("CoACD ended with code" in line for line in said)
    assert "coarse" in said[-1]
    assert depth_inside_m(np.array([[0.045, 0.045, 0.015]]), hulls)[0] < 0
    assert "coarse" in room.read_parts(user_folder() / f"{mesh.digest}.npz", KEY).note


def test_too_slow_cutting_falls_back_to_the_convex_hull(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    mesh = as_mesh(l_shape(), tmp_path, "shape")
    started: list[subprocess.Popen] = []
    popen = subprocess.Popen

    def spy(*a, **k):
        started.append(popen(*a, **k))
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", spy)
    for name in ("FINE", "COARSE"):
        monkeypatch.setattr(room, name, room.Attempt(getattr(room, name).parameters, 0.01))
    hulls = load_hulls(mesh)
    assert len(hulls) == 1
    assert any("not finished after" in line for line in said)
    assert "plain convex hull" in said[-1]
    assert len(started) == 2
    assert all(p.poll() is not None for p in started)  # killed, not left running


def test_a_run_of_coacd_is_limited_by_its_processor_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine must not change the collision shape: it would be cached for good."""
    monkeypatch.setattr(room, "MAX_WAIT_RATIO", 1000.0)
    mesh = as_mesh(trimesh.creation.torus(0.03, 0.012, major_sections=128, minor_sections=64), tmp_path, "ring")
    with pytest.raises(room._CutFailed, match="of processor time"):
        room._run_coacd(mesh, room.Attempt({**room.FINE.parameters, "mcts_iterations": 2000}, 0.2), print)


def test_parts_that_do_not_cover_the_mesh_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = as_mesh(l_shape(), tmp_path, "shape")
    stump = mesh.vertices_m[mesh.vertices_m[:, 0] < 0.021]
    monkeypatch.setattr(room, "_run_coacd", lambda *_: [stump])
    said: list[str] = []
    parts = room.decompose(mesh, said.append)
    assert any("not covered" in line for line in said)
    assert len(parts.hulls) == 1
    assert depth_inside_m(mesh.vertices_m, parts.hulls).min() > -1e-9


def test_every_shipped_object_has_a_decomposition() -> None:
    objects = Path(str(resources.files("glotouch_missions") / "objects"))
    total = 0
    for mesh in load_folder(objects):
        file = resources.files("glotouch_missions") / "hulls" / f"{mesh.digest}.npz"
        parts = read_parts(file, KEY)
        assert parts is not None, (
            f"{mesh.name}: run python -m glotouch_backends.mujoco.hulls.decompose on glotouch_missions/objects"
        )
        total += len(file.read_bytes())
        assert parts.note == ""
        assert max(map(len, parts.hulls)) <= MAX_VERTICES
        assert np.percentile(bulge_m(mesh, parts.hulls, 2000), 95) < 1.2e-3
        surface = trimesh.sample.sample_surface(mesh.as_trimesh(), 2000, seed=0)[0]
        assert np.percentile(-depth_inside_m(surface, parts.hulls), 95) < 2e-4
    assert total < 1_500_000


def test_bulge_of_a_known_overhang(tmp_path: Path) -> None:
    """A box 1 mm too large on every side: faces protrude by 1 mm, corners by sqrt 3 mm."""
    mesh = box(tmp_path)
    middle = np.array([0.0, 0.0, 0.02])
    large = middle + (mesh.vertices_m - middle) * (0.042 / 0.04)
    found = bulge_m(mesh, [large], 4000)
    assert np.median(found) == pytest.approx(1e-3, abs=1e-6)
    assert 1e-3 <= found.max() <= np.sqrt(3) * 1e-3 + 1e-6


@pytest.mark.parametrize("limit", [12, 40, 200])
def test_trimmed_hull_keeps_original_vertices_within_the_optimal_error(limit: int) -> None:
    """The best n points on a sphere miss it by 4 pi R / (3 sqrt 3 n) (a triangular lattice); the greedy choice of the
    furthest doubles the covering radius at worst (k-centre, Gonzalez 1985), which is four times the sagitta."""
    points = np.asarray(trimesh.creation.icosphere(subdivisions=4, radius=0.03).vertices)
    trimmed = trimmed_hull(points, limit, 1e-6)
    assert trimmed is not None
    assert len(trimmed) <= limit
    assert {tuple(v) for v in trimmed} <= {tuple(v) for v in points}
    missed = -depth_inside_m(points, [trimmed]).min()
    assert missed < 4 * 4 * np.pi * 0.03 / (3 * np.sqrt(3) * limit)


def test_trimmed_hull_drops_flat_parts_and_vertices_within_the_tolerance() -> None:
    rng = np.random.default_rng(0)
    flat = np.c_[rng.uniform(0, 0.05, (30, 2)), np.zeros(30)]
    assert trimmed_hull(flat, 64, 1e-4) is None
    assert trimmed_hull(flat[:3], 64, 1e-4) is None
    cube = trimesh.creation.box((0.04, 0.04, 0.04)).subdivide().subdivide().vertices
    bumpy = np.asarray(cube) * (1 + 1e-4 * rng.random((len(cube), 1)))
    trimmed = trimmed_hull(bumpy, 64, 1e-4)
    assert trimmed is not None
    assert len(trimmed) <= 12  # the corners, and the four it started from
    assert depth_inside_m(bumpy, [trimmed]).min() > -1e-4


def test_feet_stand_on_the_support_polygon(tmp_path: Path) -> None:
    height = FOOT_RADIUS_M - FOOT_PROTRUSION_M
    corners = foot_centres(box(tmp_path))
    assert corners[:, 2] == pytest.approx(height)
    assert {(round(x, 6), round(y, 6)) for x, y, _ in corners} == {(a, b) for a in (-0.02, 0.02) for b in (-0.02, 0.02)}
    round_base = foot_centres(as_mesh(trimesh.creation.cylinder(0.03, 0.05, sections=64), tmp_path, "can"))
    assert len(round_base) == MAX_FEET
    assert np.linalg.norm(round_base[:, :2], axis=1) == pytest.approx(0.03, abs=1e-6)
    octagon = ConvexHull(round_base[:, :2]).volume
    assert octagon > 0.95 * 2 * np.sqrt(2) * 0.03**2


def test_an_object_on_a_point_has_no_feet(tmp_path: Path) -> None:
    top = trimesh.creation.cone(0.02, 0.05)
    top.apply_transform(trimesh.transformations.rotation_matrix(np.pi, (1, 0, 0)))
    assert foot_centres(as_mesh(top, tmp_path, "top")).shape == (0, 3)


def test_command_writes_a_folder_and_names_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    objects, out = tmp_path / "objects", tmp_path / "out"
    objects.mkdir()
    mesh = box(objects)
    assert room.main([str(objects), "--out", str(out)]) == 0
    assert read_parts(out / f"{mesh.digest}.npz", KEY) is not None
    assert "1 parts" in capsys.readouterr().out
    assert room.main([str(tmp_path / "nowhere")]) == 2
    assert "no such folder" in capsys.readouterr().err


def mushroom() -> trimesh.Trimesh:
    return trimesh.creation.revolve(
        [(0, 0), (0.02, 0), (0.02, 0.008), (0.01, 0.012), (0.01, 0.04), (0.03, 0.045), (0, 0.065)]
    )


def test_an_overhang_stays_open(tmp_path: Path) -> None:
    mesh = as_mesh(mushroom(), tmp_path, "mushroom")
    hulls = load_hulls(mesh)
    below_the_cap = np.array([(0.025, 0.0, 0.035), (0.0, -0.02, 0.025), (-0.016, 0.0, 0.02)])
    assert depth_inside_m(below_the_cap, hulls).max() < -1e-3
    assert np.percentile(bulge_m(mesh, hulls, 3000), 95) < 1e-3


def test_overlapping_shells_are_cut_one_by_one(tmp_path: Path) -> None:
    boxes = [trimesh.creation.box(size) for size in ((0.07, 0.02, 0.04), (0.02, 0.06, 0.03), (0.01, 0.01, 0.01))]
    boxes[2].invert()  # a hollow in the middle
    hulls = load_hulls(as_mesh(trimesh.util.concatenate(boxes), tmp_path, "cross"))
    found = sorted(np.ptp(h, axis=0).round(5).tolist() for h in hulls)
    assert found == [pytest.approx(size, abs=2e-5) for size in ([0.02, 0.06, 0.03], [0.07, 0.02, 0.04])]


def test_progress_is_logged_as_a_warning_by_default(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    load_hulls(as_mesh(l_shape(), tmp_path, "shape"))
    assert any(r.levelname == "WARNING" and "cutting into convex parts" in r.message for r in caplog.records)


def test_the_worker_ends_when_its_parent_is_killed(tmp_path: Path) -> None:
    """A killed parent cannot kill its worker, which would run for minutes."""
    source = tmp_path / "in.npz"
    solid = trimesh.creation.torus(0.03, 0.01, major_sections=128, minor_sections=64)
    np.savez(source, vertices=solid.vertices, faces=solid.faces, shells=np.zeros(len(solid.faces), dtype=int))
    worker = Path(room.__file__).with_name("coacd_worker.py")
    parameters = json.dumps({**room.FINE.parameters, "mcts_iterations": 2000})
    command = [sys.executable, "-P", str(worker), str(source), str(tmp_path / "out.npz"), parameters, "60"]
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            f"import subprocess; p = subprocess.Popen({command!r}); print(p.pid, flush=True); p.wait()",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    pid = int(parent.stdout.readline())
    parent.stdout.close()
    time.sleep(2.0)
    parent.kill()
    parent.wait()
    for _ in range(100):
        if not _running(pid):
            return
        time.sleep(0.1)
    os.kill(pid, signal.SIGKILL)
    pytest.fail("the worker outlived its parent")


def _running(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"
