"""Run CoACD once, in a process of its own: `python -P coacd_worker.py IN.npz OUT.npz PARAMETERS_JSON LIMIT_S`.

CoACD needs its own process: Python can neither interrupt it nor limit its time, and a failed assertion in it ends the
process (seen in its self-intersection test on a finely tessellated mesh). The script imports nothing of this project,
so that it starts fast. `decompose` runs it.

IN.npz has `vertices` (v, 3) in any unit, `faces` (f, 3) and `shells` (f,), the number of each face's closed surface
(-1: left out); each surface is cut separately. OUT.npz gets `vertices` (n, 3) in the same unit, all hulls concatenated,
and `counts` (k,), the number of vertices of each. After LIMIT_S seconds of processor time it ends with `TOO_LONG`.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time

import coacd
import numpy as np

_CHECK_S = 0.5
TOO_LONG = 75
"""Exit code of a run that needed more than its processor time."""


def _end_in_time(limit_s: float) -> None:
    """End this process after its time, and if its parent was killed before it could kill this one.

    Processor time counts, so that a busy machine does not change the result.
    """
    parent, wake = os.getppid(), threading.Event()

    def watch() -> None:
        while os.getppid() == parent:
            if time.process_time() > limit_s:
                os._exit(TOO_LONG)
            wake.wait(_CHECK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def main(source: str, target: str, parameters: str, limit_s: str) -> None:
    """Decompose one mesh; every failure gives a non-zero exit code."""
    _end_in_time(float(limit_s))
    if hasattr(os, "nice"):
        os.nice(10)  # do not slow a control loop on this machine
    with np.load(source) as data:
        vertices, faces, shells = data["vertices"], data["faces"], data["shells"]
    # CoACD's float32 geometry needs a mesh of about unit size
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
