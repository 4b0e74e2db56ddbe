"""A recorded dataset: a folder with one npz file a TouchSet and one JSON of truth a layout.

`s0020.json` lists the objects in the box of seed 20 and the true object of each `s0020-c<index>.npz`. Poses are
(x, y, yaw) of the mesh frame in the container frame given to the robot, so errors against them are grasp errors.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.bench.match.touchset_file import load_touchset, save_touchset
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import write_file

VERSION = 1
Planar = tuple[float, float, float]


@dataclass(frozen=True)
class Touched:
    """One candidate's TouchSet with its true object.

    Attributes:
        touchset: The TouchSet.
        name: STL stem of the true object; None for a false candidate.
        pose_K_O: Pose of that object after all squeezing; None if `name` is.
        tilt_rad: Tilt of its z axis against the container's then; None if `name` is.
    """

    touchset: TouchSet
    name: str | None
    pose_K_O: Planar | None = None
    tilt_rad: float | None = None


@dataclass(frozen=True)
class Layout:
    """All labelled TouchSets of one box.

    Attributes:
        seed: Seed of the trial.
        conditions: Name of the profile.
        objects: Names of the objects in the box.
        touched: One entry a squeezed candidate, in the order of squeezing.
        ended: "success", or the root failure code.
        sim_s: Robot time of the mission.
    """

    seed: int
    conditions: str
    objects: tuple[str, ...]
    touched: tuple[Touched, ...]
    ended: str = "success"
    sim_s: float = float("nan")

    def of(self, name: str) -> tuple[int, ...]:
        """Return the indices in `touched` of an object; empty if it was never squeezed."""
        return tuple(i for i, t in enumerate(self.touched) if t.name == name)


def write_layout(folder: Path, layout: Layout) -> Path:
    """Write one layout's files into a folder, created if needed. The JSON comes last and marks the layout complete.

    Raises:
        BadInput: A file cannot be written.
    """
    stem = f"s{layout.seed:04d}"
    candidates: list[dict[str, Any]] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for t in layout.touched:
            index = t.touchset.candidate.index
            file = f"{stem}-c{index}.npz"
            save_touchset(folder / file, t.touchset)
            felt = sum(layer.stable for layer in t.touchset.layers)
            candidates.append(
                {"file": file, "index": index, "object": t.name, "pose_K_O": t.pose_K_O, "tilt_rad": t.tilt_rad,
                 "closures": len(t.touchset.layers), "stable": felt}
            )  # fmt: skip
        content = {
            "version": VERSION, "seed": layout.seed, "conditions": layout.conditions, "objects": list(layout.objects),
            "ended": layout.ended, "sim_s": layout.sim_s, "candidates": candidates,
        }  # fmt: skip
        write_file(folder / f"{stem}.json", (json.dumps(content, indent=1) + "\n").encode())
    except OSError as e:
        raise BadInput(f"{folder}: cannot be written ({e.strerror})") from e
    return folder / f"{stem}.json"


def layout_files(folder: Path) -> list[Path]:
    """Return the JSON files of a dataset's layouts, by seed.

    Raises:
        BadInput: No such folder, or no layout in it.
    """
    files = sorted(folder.glob("s[0-9]*.json")) if folder.is_dir() else []
    if not files:
        raise BadInput(f"{folder}: is not a folder of recorded TouchSets (no s<seed>.json in it)")
    return files


def read_layout(file: Path) -> Layout:
    """Read one layout.

    Raises:
        BadInput: The JSON or one of its npz files is unreadable, of another version, or inconsistent.
    """
    try:
        content = json.loads(file.read_text())
        if content["version"] != VERSION:
            raise BadInput(f"{file}: is of version {content['version']}; this release reads version {VERSION}")
        touched = tuple(_touched(file, c) for c in content["candidates"])
        objects = tuple(str(o) for o in content["objects"])
        return Layout(
            int(content["seed"]), str(content["conditions"]), objects, touched, str(content["ended"]),
            float(content["sim_s"]),
        )  # fmt: skip
    except OSError as e:
        raise BadInput(f"{file}: cannot be read ({e.strerror})") from e
    except (ValueError, KeyError, TypeError) as e:
        raise BadInput(f"{file}: is not a layout's truth ({type(e).__name__}: {e})") from e


def _touched(file: Path, entry: Mapping[str, Any]) -> Touched:
    touchset = load_touchset(file.parent / Path(str(entry["file"])).name)
    if touchset.candidate.index != int(entry["index"]):
        raise BadInput(f"{file}: {entry['file']} holds candidate {touchset.candidate.index}, not {entry['index']}")
    name = None if entry["object"] is None else str(entry["object"])
    pose, tilt = entry["pose_K_O"], entry["tilt_rad"]
    if (name is None) != (pose is None) or (pose is not None and len(pose) != 3):
        raise BadInput(f"{file}: candidate {entry['index']} must have an object and its (x, y, yaw), or neither")
    known: Planar | None = None if pose is None else (float(pose[0]), float(pose[1]), float(pose[2]))
    return Touched(touchset, name, known, None if tilt is None else float(tilt))
