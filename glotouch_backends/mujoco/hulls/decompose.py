"""Non-convex collision shapes: an object as a set of convex hulls, computed once and cached.

A plain convex hull is the wrong shape (a mug's handle measures 20.6 mm instead of 7.7), and MuJoCo's `type="sdf"` costs
forty times more and misses edges. CoACD (Wei et al., SIGGRAPH 2022) cuts the mesh into nearly convex parts. It takes
10-60 s an object, so the result is looked up by the mesh's content (`Mesh.digest`) and the parameters:

    1. in the package, glotouch_missions/hulls/<digest>.npz (read only; the shipped objects)
    2. in the user's cache, $XDG_CACHE_HOME/glotouch-bt/hulls or ~/.cache/glotouch-bt/hulls
    3. else computed in a separate process and written to 2

A damaged file, one made with other parameters, and one of the user's cache whose hulls do not cover the mesh count as
absent. New results are read back from the stored bytes, so
that the first run and later ones use the same floats. docs/decisions/0004-convex-decomposition.md has the measurements
behind the parameters.

To recompute: `python -m glotouch_backends.mujoco.hulls.decompose FOLDER [--out DIR]`.
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
import scipy

from glotouch_backends.mujoco.hulls.bulge import bulge_m, depth_inside_m
from glotouch_backends.mujoco.hulls.convex_parts import trimmed_hull
from glotouch_backends.mujoco.hulls.files import (
    MAX_VERTICES,
    Parts,
    locked,
    package_file,
    read_parts,
    user_folder,
    write_parts,
)
from glotouch_backends.mujoco.hulls.shells import shell_labels
from glotouch_backends.mujoco.hulls.simplify import simplified
from glotouch_bt.robot import Array, BadInput, frozen_array
from glotouch_bt.robot.scene import Mesh, load_folder

Progress = Callable[[str], None]
_log = logging.getLogger(__name__)

TOLERANCE_M = 0.0001
"""Vertices that protrude less than this from the trimmed hull are dropped. Source: ours."""
MAX_GAP_M = 0.002
"""Refuse a decomposition if a vertex of the mesh lies further outside every hull. Source: ours."""
MAX_WAIT_RATIO = 8.0
"""Longest wait for CoACD in wall time over its limit of processor time; others may use the machine. Source: ours."""
TOO_LONG = 75
"""Exit code of `coacd_worker` after its processor time."""
_POLL_S = 10.0
"""Interval between two progress messages."""


@dataclass(frozen=True)
class Attempt:
    """One parameter set of CoACD.

    Attributes:
        parameters: Keyword arguments of `coacd.run_coacd`.
        limit_s: Processor time after which it ends; `MAX_WAIT_RATIO` times as much wall time is the longest wait.
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
"""Key of a cached result: the requested parameters. A coarser fallback is cached under the same key, with a note."""


def load_hulls(mesh: Mesh) -> tuple[Array, ...]:
    """Return the collision shape of a mesh from the package, the user's cache, or a computation of about a minute.

    What takes long or is coarser than requested is a log warning, which Python prints to stderr, because a silent
    minute looks like a hang.

    Returns:
        (k_i, 3) corners of each convex part in the mesh frame (lowest vertex at z = 0), m; 4 <= k_i <= 256; read-only.

    Raises:
        BadInput: The solid has no volume.
    """
    name = f"{mesh.digest}.npz"
    parts = read_parts(package_file(name), KEY)
    if parts is None:
        parts = _from_folder(mesh, user_folder() / name)
    if parts.note:
        _log.warning(f"{mesh.name}: {parts.note}")
    return tuple(frozen_array("hull", h, h.shape) for h in parts.hulls)


def _from_folder(mesh: Mesh, path: Path) -> Parts:
    found = _fitting(mesh, path)
    if found is not None:
        return found
    with locked(path, lambda: _log.warning(f"{mesh.name}: waiting for another process to decompose it")):
        found = _fitting(mesh, path)  # another process may have written it meanwhile
        if found is not None:
            return found
        return write_parts(path, KEY, decompose(mesh), _log.warning)


def _fitting(mesh: Mesh, path: Path) -> Parts | None:
    """Return the parts in a file if they cover the mesh and stay within its bounding box."""
    found = read_parts(path, KEY)
    try:
        if found is not None:
            _check(mesh, found.hulls)
    except (_CutFailed, scipy.spatial.QhullError, ValueError):  # hulls without a volume
        return None
    return found


def decompose(mesh: Mesh, progress: Progress | None = None) -> Parts:
    """Cut a mesh into convex parts, without the cache.

    Try `FINE`, then `COARSE`, then fall back to the convex hull; the note says which one was used.

    Raises:
        BadInput: The mesh has no convex hull.
    """
    say = progress or _log.warning
    say(f"{mesh.name}: cutting into convex parts (once per mesh, 10-60 s)")
    for attempt, note in (
        (FINE, ""),
        (COARSE, "collision shape is coarse (16 parts): fine cutting failed"),
    ):
        try:
            trimmed = (trimmed_hull(p, MAX_VERTICES, TOLERANCE_M) for p in _run_coacd(mesh, attempt, say))
            hulls = tuple(h for h in trimmed if h is not None)
            _check(mesh, hulls)
        except _CutFailed as e:
            say(f"{mesh.name}: cutting failed ({e}); trying coarser parameters")
            continue
        return Parts(hulls, note)
    hull = trimmed_hull(mesh.vertices_m, MAX_VERTICES, TOLERANCE_M)
    if hull is None:
        raise BadInput(f"{mesh.name}: no collision shape can be computed; the mesh must enclose a volume")
    return Parts((hull,), "collision shape is the plain convex hull: cutting failed; repair the mesh for an exact one")


class _CutFailed(Exception):
    """One attempt gave no usable parts."""


def _check(mesh: Mesh, hulls: Sequence[Array]) -> None:
    """Check that the hulls cover every vertex of the mesh and stay within its bounding box."""
    if not hulls:
        raise _CutFailed("no part has a volume")
    gap_m = -float(depth_inside_m(mesh.vertices_m, hulls).min())
    if gap_m > MAX_GAP_M:
        raise _CutFailed(f"{gap_m * 1e3:.1f} mm of the surface are not covered")
    points = np.concatenate(hulls)
    beyond_m = max(
        float((mesh.vertices_m.min(axis=0) - points.min(axis=0)).max()),
        float((points.max(axis=0) - mesh.vertices_m.max(axis=0)).max()),
    )
    if beyond_m > MAX_GAP_M:
        raise _CutFailed(f"the parts protrude {beyond_m * 1e3:.1f} mm from the mesh")


def _run_coacd(mesh: Mesh, attempt: Attempt, say: Progress) -> list[Array]:
    """Run `coacd_worker`, and kill it at the time limit, on an error and on Ctrl-C; return the raw parts."""
    worker = Path(__file__).with_name("coacd_worker.py")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "mesh.npz", Path(folder) / "parts.npz"
        vertices, faces = simplified(mesh)
        np.savez(source, vertices=vertices, faces=faces, shells=shell_labels(vertices, faces))
        process = subprocess.Popen(
            # -P: keep the worker's folder off sys.path, where its files would shadow installed modules
            [sys.executable, "-P", worker, source, target, json.dumps(attempt.parameters), str(attempt.limit_s)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        try:
            waited_s, longest_s = 0.0, MAX_WAIT_RATIO * attempt.limit_s
            while True:
                try:
                    code = process.wait(timeout=min(_POLL_S, longest_s - waited_s))
                    break
                except subprocess.TimeoutExpired:
                    waited_s += min(_POLL_S, longest_s - waited_s)
                    if waited_s >= longest_s:
                        raise _CutFailed(f"not finished after {longest_s:.0f} s") from None
                    say(f"{mesh.name}: still cutting, {waited_s:.0f} s")
        finally:
            process.kill()
            process.wait()
        if code == TOO_LONG:
            raise _CutFailed(f"not finished after {attempt.limit_s:.0f} s of processor time")
        if code != 0 or not target.is_file():
            raise _CutFailed(f"CoACD ended with code {code}")
        with np.load(target) as data:
            return np.split(data["vertices"], np.cumsum(data["counts"])[:-1])


def main(arguments: Sequence[str] | None = None) -> int:
    """Decompose a folder of STL files and print one line a mesh. Return the exit code: 0, or 2 for bad input."""
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
