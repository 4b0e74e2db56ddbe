"""What matching costs on one core with nothing else to do: a new STL, its first ranking, a pair."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.recognition import TargetModel
from glotouch_bt.study.match.dataset import Layout
from glotouch_bt.study.match.methods import DEFAULT, methods
from glotouch_bt.study.match.trials import meshes_of, pad_of

REPEATS = 3


def time_matching(layouts: Sequence[Layout], objects: Path, names: Sequence[str]) -> dict[str, Any]:
    """Medians over the STLs of the folder: wall and processor time.

    `new_stl_s` is from the mesh to the end of the first ranking, less a second ranking: whatever is tabulated once, at
    whichever moment. The mesh passes for one never seen by bearing another content hash.
    """
    touched = [x for x in layouts if x.touched][:REPEATS]
    if not touched:
        return {}
    made = {n: m for n, m in methods().items() if n in names}
    out: dict[str, Any] = {
        "new_stl_s": [],
        "new_stl_cpu_s": [],
        "pair_ms": {n: [] for n in made},
        "pair_cpu_ms": {n: [] for n in made},
    }
    first = [t.touchset for t in touched[0].touched]
    method = made.get(DEFAULT, next(iter(made.values())))
    for mesh in meshes_of(objects).values():
        unseen = replace(mesh, digest=f"timing {time.perf_counter_ns()} {mesh.digest}")
        stamps = [_clocks()]
        model = TargetModel.from_mesh(unseen, pad_of(touched[0]))
        for _ in range(2):
            method(model, first)
            stamps.append(_clocks())
        first_time, again = np.diff(np.array(stamps), axis=0)
        for key, spent in zip(("new_stl_s", "new_stl_cpu_s"), first_time - again, strict=True):
            out[key].append(float(spent))
        for layout in touched:
            touchsets = [t.touchset for t in layout.touched]
            for name, of in made.items():
                of(model, touchsets)  # what it keeps of a TouchSet or a model is made here
                began = _clocks()
                of(model, touchsets)
                for key, now, then in zip(("pair_ms", "pair_cpu_ms"), _clocks(), began, strict=True):
                    out[key][name].append(1e3 * (now - then) / len(touchsets))
    return {
        "new_stl_s": float(np.median(out["new_stl_s"])),
        "new_stl_cpu_s": float(np.median(out["new_stl_cpu_s"])),
        "new_stl_worst_s": float(np.max(out["new_stl_s"])),
        "pair_ms": {n: float(np.median(v)) for n, v in out["pair_ms"].items()},
        "pair_cpu_ms": {n: float(np.median(v)) for n, v in out["pair_cpu_ms"].items()},
    }


def _clocks() -> tuple[float, float]:
    """(wall, processor) time, s."""
    return time.perf_counter(), time.process_time()
