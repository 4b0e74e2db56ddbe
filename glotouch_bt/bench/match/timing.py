"""Cost of matching on one idle core: a new STL, an STL from the cache, and a (target, TouchSet) pair."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from glotouch_bt.bench.match.dataset import Layout
from glotouch_bt.bench.match.methods import DEFAULT, Method, Target, methods
from glotouch_bt.bench.match.trials import meshes_of, pad_of
from glotouch_bt.perception import target_model
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import Array

REPEATS = 3


def time_matching(layouts: Sequence[Layout], objects: Path, names: Sequence[str]) -> dict[str, Any]:
    """Return medians over the STLs of the folder, as wall time and (`_cpu`) processor time.

    `new_stl_s`: build and save the model of an uncached mesh. `load_stl_ms`: map a saved model. Both include the tables
    built at first use: the first ranking's extra time over a second one. `pair_ms`: one ranking of a box divided by its
    TouchSets, with everything warm, of the mesh as it stands in its file. Missions compare all its sides.
    """
    touched = [x for x in layouts if x.touched][:REPEATS]
    if not touched:
        return {}
    made = {n: m for n, m in methods().items() if n in names}
    head = made.get(DEFAULT, next(iter(made.values())))
    first = [t.touchset for t in touched[0].touched]
    new, load = [], []
    pairs: dict[str, list[Array]] = {n: [] for n in made}
    with TemporaryDirectory() as folder:
        for mesh in meshes_of(objects).values():
            unseen = replace(mesh, digest=f"timing {time.perf_counter_ns()} {mesh.digest}")
            here, there = Path(folder) / f"{mesh.name} built", Path(folder) / f"{mesh.name} moved"
            began = _clocks()
            model = target_model(unseen, pad_of(touched[0]), here)
            new.append(_clocks() - began + _first_use(head, Target(mesh, model), first))
            shutil.copytree(here, there)
            began = _clocks()
            model = target_model(unseen, pad_of(touched[0]), there)
            load.append(_clocks() - began + _first_use(head, Target(mesh, model), first))
            for layout in touched:
                touchsets = [t.touchset for t in layout.touched]
                for name, method in made.items():
                    method(Target(mesh, model), touchsets)
                    pairs[name].append(_spent(method, Target(mesh, model), touchsets) / len(touchsets))
    wall, cpu = ({n: float(1e3 * np.median(v, axis=0)[k]) for n, v in pairs.items()} for k in (0, 1))
    out: dict[str, Any] = {"pair_ms": wall, "pair_cpu_ms": cpu}
    for key, spent in (("new_stl", new), ("load_stl", load)):
        unit, scale = ("s", 1.0) if key == "new_stl" else ("ms", 1e3)
        out[f"{key}_{unit}"], out[f"{key}_cpu_{unit}"] = (float(scale * x) for x in np.median(spent, axis=0))
        out[f"{key}_worst_{unit}"] = float(scale * np.max(spent, axis=0)[0])
    return out


def _clocks() -> Array:
    """Return (wall, processor) time, s."""
    return np.array([time.perf_counter(), time.process_time()])


def _spent(method: Method, target: Target, touchsets: Sequence[TouchSet]) -> Array:
    began = _clocks()
    method(target, touchsets)
    return _clocks() - began


def _first_use(method: Method, target: Target, touchsets: Sequence[TouchSet]) -> Array:
    """Return the extra time of the first ranking over the second, at least 0."""
    return np.asarray(np.maximum(_spent(method, target, touchsets) - _spent(method, target, touchsets), 0.0))
