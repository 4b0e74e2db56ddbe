"""A recorded dataset: a folder with one npz file a TouchSet and one JSON of truth a layout.

`s0020.json` says what stood in the box of seed 20 and which object each `s0020-c<index>.npz` really is. Poses are
(x, y, yaw) of the mesh's frame in the container frame the robot was told: an error against them is one the grasp has.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.bench.match.touchset_file import load_touchset, save_touchset
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import BadInput

VERSION = 1
Planar = tuple[float, float, float]


@dataclass(frozen=True)
class Touched:
    """One candidate's TouchSet and what it really is.

    Attributes:
        touchset: What the pads felt.
        name: The true object's STL stem; None if no object stood where the candidate was found.
        pose_K_O: Where that object stood when all squeezing was over; None with `name`.
        tilt_rad: Angle between its z axis and the container's then; None with `name`.
    """

    touchset: TouchSet
    name: str | None
    pose_K_O: Planar | None = None
    tilt_rad: float | None = None


@dataclass(frozen=True)
class Layout:
    """All that was felt in one box.

    Attributes:
        seed: Of the trial.
        conditions: Stem of the profile.
        objects: Names of what stood in the box.
        touched: One a squeezed candidate, in the order of squeezing.
        ended: How the mission ended: "success", or its root reason's code.
        sim_s: Robot time of the mission.
    """

    seed: int
    conditions: str
    objects: tuple[str, ...]
    touched: tuple[Touched, ...]
    ended: str = "success"
    sim_s: float = float("nan")

    def of(self, name: str) -> tuple[int, ...]:
        """Places in `touched` of an object; empty if it was never squeezed."""
        return tuple(i for i, t in enumerate(self.touched) if t.name == name)


def write_layout(folder: Path, layout: Layout) -> Path:
    """Write one layout's files into a folder, which is made; the JSON comes last, so a layout is whole or not there.

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
        part = folder / f".{stem}.json.part"
        part.write_text(json.dumps(content, indent=1) + "\n")
        os.replace(part, folder / f"{stem}.json")
    except OSError as e:
        raise BadInput(f"{folder}: cannot be written ({e.strerror})") from e
    return folder / f"{stem}.json"


def layout_files(folder: Path) -> list[Path]:
    """The JSON files of a dataset's layouts, by seed.

    Raises:
        BadInput: No such folder, or no layout in it.
    """
    files = sorted(folder.glob("s[0-9]*.json")) if folder.is_dir() else []
    if not files:
        raise BadInput(f"{folder}: is not a folder of recorded TouchSets (no s<seed>.json in it)")
    return files


def read_layout(file: Path) -> Layout:
    """One layout.

    Raises:
        BadInput: The JSON or one of its npz files is unreadable, of another version, or says something impossible.
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


def read_dataset(folder: Path, first: int | None = None) -> list[Layout]:
    """The layouts of a dataset, by seed; at most `first` of them.

    Raises:
        BadInput: As `layout_files` and `read_layout`, or two layouts have the same seed.
    """
    layouts = [read_layout(f) for f in layout_files(folder)[:first]]
    seeds: Sequence[int] = [x.seed for x in layouts]
    if len(set(seeds)) < len(seeds):
        raise BadInput(f"{folder}: two layouts have the same seed")
    return layouts
