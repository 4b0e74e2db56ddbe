"""Run CoACD once, as a script in a process of its own: `python -P coacd_worker.py IN.npz OUT.npz PARAMETERS_JSON`.

Why a process: CoACD is C++ that can neither be interrupted nor given a time limit from Python, and that ends the whole
process on a failed assertion (seen in its self-intersection test on a mesh that is merely finely tessellated). Imports
nothing of this project, so that starting it is cheap. Read by `decompose`.

IN.npz holds `vertices` (v, 3) in any unit, `faces` (f, 3) and `shells` (f,), the number of the closed surface each face
is of (-1: left out); each is cut by itself. OUT.npz gets `vertices` (n, 3) in the same unit, all
hulls behind one another, and `counts` (k,), the number of vertices of each.
"""

from __future__ import annotations

import json
import os
import sys
import threading

import coacd
import numpy as np

_ALONE_S = 0.5


def _end_with_parent() -> None:
    """Do not go on for minutes for a parent that was killed before it could kill this process."""
    parent, wake = os.getppid(), threading.Event()

    def watch() -> None:
        while os.getppid() == parent:
            wake.wait(_ALONE_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def main(source: str, target: str, parameters: str) -> None:
    """Decompose one mesh; any failure is a non-zero exit."""
    _end_with_parent()
    if hasattr(os, "nice"):
        os.nice(10)  # minutes of background work must not slow a control loop beside it
    with np.load(source) as data:
        vertices, faces, shells = data["vertices"], data["faces"], data["shells"]
    # CoACD's float32 geometry tests want a mesh of about unit size, not one of centimetres written in metres
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    scale = 0.5 * float(np.ptp(vertices, axis=0).max())
    coacd.set_log_level("off")
    given = json.loads(parameters)
    count = int(shells.max()) + 1
    given["max_convex_hull"] = max(1, given["max_convex_hull"] // count)
    parts = []
    for i in range(count):
        used, corners = np.unique(faces[shells == i], return_inverse=True)
        shell = coacd.Mesh((vertices[used] - centre) / scale, corners.reshape(-1, 3).astype(np.int32))
        parts += coacd.run_coacd(shell, **given)
    np.savez(
        target,
        vertices=np.concatenate([v for v, _ in parts]) * scale + centre,
        counts=np.array([len(v) for v, _ in parts]),
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
