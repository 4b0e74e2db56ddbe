"""True non-convex collision shapes: an object as a set of convex hulls, computed once and kept.

A plain convex hull is a wrong object (a mug's handle measured 20.6 mm for 7.7); MuJoCo's `type="sdf"` costs forty times
more and misses edges. CoACD (Wei et al., SIGGRAPH 2022) cuts the mesh into nearly convex parts; it takes 10-60 s an
object, so the result is looked up by what the mesh IS (`Mesh.digest`) and by the parameters:

    1. the package's own glotouch_missions/hulls/<digest>.npz   (read only; the shipped objects)
    2. the user's cache, $XDG_CACHE_HOME/glotouch-bt/hulls or ~/.cache/glotouch-bt/hulls
    3. computed in a process of its own, then written to 2

A file that is damaged, or made with other parameters, is as good as absent. Results are read back from the bytes that
are stored, so that a first run and every later one see the same floats. The measurements behind the parameters are in
docs/decisions/0004-convex-decomposition.md.

Redo: `python -m glotouch_backends.mujoco.hulls.decompose FOLDER [--out DIR]`.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glotouch_backends.mujoco.hulls.bulge import bulge_m, depth_inside_m
from glotouch_backends.mujoco.hulls.convex_parts import trimmed_hull
from glotouch_backends.mujoco.hulls.feet import foot_centres
from glotouch_backends.mujoco.hulls.files import Parts, locked, package_file, read_parts, user_folder, write_parts
from glotouch_backends.mujoco.hulls.shells import shell_labels
from glotouch_backends.mujoco.hulls.simplify import simplified
from glotouch_bt.robot import Array, BadInput, frozen_array
from glotouch_bt.robot.scene import Mesh, load_folder

Progress = Callable[[str], None]
_log = logging.getLogger(__name__)

MAX_VERTICES = 256
"""Of one hull. With 64 an apple's one large part falls 0.6 mm (p95) short of its surface, with 256 0.1 mm; MuJoCo walks
the hull's graph, so that the step does not get slower."""
TOLERANCE_M = 0.0001
MAX_GAP_M = 0.002
"""No vertex of the mesh may lie further outside every hull than this, or the decomposition is refused."""
_POLL_S = 10.0


@dataclass(frozen=True)
class Attempt:
    """One way to run CoACD.

    Attributes:
        parameters: Keyword arguments of `coacd.run_coacd`.
        limit_s: Wall time after which it is given up.
    """

    parameters: dict[str, float | int | str | bool]
    limit_s: float


FINE = Attempt(
    {
        "threshold": 0.02,
        "max_convex_hull": 32,
        "preprocess_mode": "off",  # a Mesh is watertight already; CoACD's own check can abort the process
        "mcts_iterations": 60,
        "mcts_nodes": 20,
        "mcts_max_depth": 2,
        "seed": 0,
    },
    limit_s=150.0,
)
COARSE = Attempt(
    {
        "threshold": 0.05,
        "max_convex_hull": 16,
        "preprocess_mode": "on",  # voxel remeshing: survives meshes that cut through themselves
        "preprocess_resolution": 30,
        "mcts_iterations": 30,
        "mcts_nodes": 10,
        "mcts_max_depth": 2,
        "resolution": 1000,
        "seed": 0,
    },
    limit_s=90.0,
)
KEY = json.dumps(
    {"version": 1, "max_vertices": MAX_VERTICES, "tolerance_m": TOLERANCE_M, **FINE.parameters}, sort_keys=True
)
"""What was asked for. A coarser result that had to do is kept under the same key, with a note."""


@dataclass(frozen=True)
class Hulls:
    """An object's collision shape, in the mesh frame (lowest vertex at z = 0), m.

    Attributes:
        vertices: (k_i, 3) of each convex part, every one a corner of its hull, 4 <= k_i <= 256; read-only.
        feet: (m, 3) centres of spheres of radius `feet.FOOT_RADIUS_M` round the base, m <= 8; see `feet`.
    """

    vertices: tuple[Array, ...]
    feet: Array


def load_hulls(mesh: Mesh, progress: Progress | None = None) -> Hulls:
    """The collision shape of one mesh, from the package, the user's cache, or computed now (up to a minute or so).

    Args:
        mesh: A checked solid.
        progress: Told, in one line each, when something takes long or had to be made coarser. By default that is
            logged as a warning, which Python shows on stderr unless told otherwise: a minute's silence looks like a
            hang, in a worker process too.

    Raises:
        BadInput: The hulls cannot be computed: the solid has no volume.
    """
    say = progress or _log.warning
    name = f"{mesh.digest}.npz"
    parts = read_parts(package_file(name), KEY)
    if parts is None:
        parts = _from_folder(mesh, user_folder() / name, say)
    if parts.note:
        say(f"{mesh.name}: {parts.note}")
    return Hulls(tuple(frozen_array("hull", h, h.shape) for h in parts.hulls), foot_centres(mesh))


def _from_folder(mesh: Mesh, path: Path, say: Progress) -> Parts:
    found = read_parts(path, KEY)
    if found is not None:
        return found
    with locked(path, lambda: say(f"{mesh.name}: waiting for another process to decompose it")):
        found = read_parts(path, KEY)  # another process may have made it meanwhile
        if found is not None:
            return found
        return write_parts(path, KEY, decompose(mesh, say), say)


def decompose(mesh: Mesh, progress: Progress | None = None) -> Parts:
    """Cut a mesh into convex parts, without any cache.

    Tries `FINE`, then `COARSE`, then settles for the plain convex hull; the result's note says so.

    Raises:
        BadInput: Not even the convex hull exists.
    """
    say = progress or _log.warning
    say(f"{mesh.name}: cutting into convex parts (once per mesh, 10-60 s)")
    for attempt, note in (
        (FINE, ""),
        (COARSE, "collision shape is coarse (16 parts): fine cutting failed"),
    ):
        try:
            hulls = _trim(_run_coacd(mesh, attempt, say))
            _check(mesh, hulls)
        except _CutFailed as e:
            say(f"{mesh.name}: cutting failed ({e}); trying a coarser way")
            continue
        return Parts(hulls, note)
    hull = trimmed_hull(mesh.vertices_m, MAX_VERTICES, TOLERANCE_M)
    if hull is None:
        raise BadInput(f"{mesh.name}: no collision shape can be made; the mesh must enclose a volume")
    return Parts((hull,), "collision shape is the plain convex hull: cutting failed; repair the mesh for a true one")


class _CutFailed(Exception):
    """One attempt gave nothing usable."""


def _trim(parts: Sequence[Array]) -> tuple[Array, ...]:
    trimmed = (trimmed_hull(p, MAX_VERTICES, TOLERANCE_M) for p in parts)
    return tuple(h for h in trimmed if h is not None)


def _check(mesh: Mesh, hulls: Sequence[Array]) -> None:
    """Every vertex of the mesh is covered, and nothing reaches out of its bounding box."""
    if not hulls:
        raise _CutFailed("no part has a volume")
    gap_m = -float(depth_inside_m(mesh.vertices_m, hulls).min())
    if gap_m > MAX_GAP_M:
        raise _CutFailed(f"the parts leave {gap_m * 1e3:.1f} mm of the surface bare")
    points = np.concatenate(hulls)
    beyond_m = max(
        float((mesh.vertices_m.min(axis=0) - points.min(axis=0)).max()),
        float((points.max(axis=0) - mesh.vertices_m.max(axis=0)).max()),
    )
    if beyond_m > MAX_GAP_M:
        raise _CutFailed(f"the parts reach {beyond_m * 1e3:.1f} mm out of the mesh")


def _run_coacd(mesh: Mesh, attempt: Attempt, say: Progress) -> list[Array]:
    """Raw parts from `coacd_worker` in a process that is killed at the limit, on an error, and on Ctrl-C."""
    worker = Path(__file__).with_name("coacd_worker.py")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "mesh.npz", Path(folder) / "parts.npz"
        vertices, faces = simplified(mesh)
        np.savez(source, vertices=vertices, faces=faces, shells=shell_labels(vertices, faces))
        process = subprocess.Popen(
            # -P: without it the worker's own folder is on sys.path, and its files shadow installed modules
            [sys.executable, "-P", str(worker), str(source), str(target), json.dumps(attempt.parameters)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        try:
            waited_s = 0.0
            while True:
                try:
                    code = process.wait(timeout=min(_POLL_S, attempt.limit_s - waited_s))
                    break
                except subprocess.TimeoutExpired:
                    waited_s += min(_POLL_S, attempt.limit_s - waited_s)
                    if waited_s >= attempt.limit_s:
                        raise _CutFailed(f"not done after {attempt.limit_s:.0f} s") from None
                    say(f"{mesh.name}: still cutting, {waited_s:.0f} s")
        finally:
            process.kill()
            process.wait()
        if code != 0 or not target.is_file():
            raise _CutFailed(f"CoACD ended with code {code}")
        with np.load(target) as data:
            return np.split(data["vertices"], np.cumsum(data["counts"])[:-1])


def main(arguments: Sequence[str] | None = None) -> int:
    """Decompose a folder of STLs; prints one line a mesh. Returns the exit code: 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m glotouch_backends.mujoco.hulls.decompose", description=main.__doc__
    )
    parser.add_argument("folder", type=Path, help="folder of watertight STL files in metres")
    parser.add_argument(
        "--out", type=Path, default=None, help="where to write <digest>.npz (default: the user's cache)"
    )
    options = parser.parse_args(arguments)
    out = options.out or user_folder()

    def say(line: str) -> None:
        print(line, flush=True)

    try:
        for mesh in load_folder(options.folder):
            parts = write_parts(out / f"{mesh.digest}.npz", KEY, decompose(mesh, say), say)
            bulge = bulge_m(mesh, parts.hulls) * 1e3
            say(
                f"{mesh.name}: {len(parts.hulls)} parts, {sum(map(len, parts.hulls))} vertices, "
                f"bulge p95 {np.percentile(bulge, 95):.2f} mm, max {bulge.max():.2f} mm. {parts.note}"
            )
    except BadInput as e:
        print(e, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
