"""A dataset to publish: TouchSets with their truth, by conditions, with the meshes, a description and checksums.

dataset.json                  name, version, how it was made, and the SHA-256 of every file
README.md                     the format, for readers who do not have this package
objects/NAME.stl              meshes in metres
CONDITIONS/sSEED.json         the truth of one layout; see `dataset`
CONDITIONS/sSEED-cINDEX.npz   one TouchSet; see `touchset_file`
"""

from __future__ import annotations

import hashlib
import inspect
import json
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.bench.match.bench import MatchCampaign
from glotouch_bt.bench.match.dataset import Layout, layout_files, read_layout
from glotouch_bt.campaign import OnRow, code_versions, commit_of_source, run_trials, silent
from glotouch_bt.mission.read import conditions_name
from glotouch_bt.perception.touch import Candidate, Contact, Contour, Layer, TouchSequence
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import Mesh, load_folder, stl_files
from glotouch_bt.runs import RunFolder
from glotouch_bt.untrusted import read_json

FORMAT = "glotouch-touchsets-1"
"""Name of the format in dataset.json; a change that old readers cannot read gets another number."""
MANIFEST = "dataset.json"
PARTS = {
    "candidate": Candidate,
    "contour": Contour,
    "contact": Contact,
    "sequence": TouchSequence,
    "layer": Layer,
}
"""Values of a TouchSet, by the prefix of their columns."""
README = """# {name} {version}

TouchSets: what a probe and a pair of tactile fingers felt of single objects in a box, with the truth. {count} TouchSets
of {layouts} layouts, simulated. Made by GLoTouch-BT ({commit}) with

    {command}

## Files

- `dataset.json`: format, version, conditions, seeds, and the SHA-256 of every file. `digest` is that of the whole set.
- `objects/NAME.stl`: the objects, in metres. Frame O: the mesh shifted so that its lowest vertex is at z = 0 and its
  bounding box centred on x = y = 0.
- `CONDITIONS/sSEED.json`: one layout. `objects` are the names in the box; `candidates` lists what was touched: `file`,
  `index`, `object` (the true one; null for a false candidate), `pose_K_O` (x, y, yaw of O in the container frame K,
  m and rad, after all touches), `tilt_rad`, `closures`, `stable` (closures on which the aperture reached a plateau
  while the arm stood still).
- `CONDITIONS/sSEED-cINDEX.npz`: one TouchSet, as NumPy arrays without pickles. Rows of `layer.*` belong to the
  sequences in order: `sequence.layers` says how many to each.

SI units. Frames: K, the container's floor, z up; P, the middle between the pads. A depth map is (rows, columns), m,
row 0 nearest the wrist; NaN is a dead taxel.

## Columns of a TouchSet

| column | type | shape in the first file | meaning |
|---|---|---|---|
{columns}

## Read it

    import numpy as np
    touchset = np.load("nominal/s0400-c0.npz")
    touchset["layer.left_m"]                      # (closures, rows, columns)

    from glotouch_bt.bench.match import load_dataset
    dataset = load_dataset("DIR")                 # checks the SHA-256 of every file
    for layout in dataset.layouts("nominal"):
        for touched in layout.touched:
            touched.name, touched.touchset

`glotouch bench match --dataset DIR/nominal --objects DIR/objects` lets every installed matcher decide on it.
"""


@dataclass(frozen=True)
class Dataset:
    """A published dataset whose files were checked.

    Attributes:
        folder: Its folder.
        manifest: Content of dataset.json.
    """

    folder: Path
    manifest: Mapping[str, Any]

    @property
    def conditions(self) -> tuple[str, ...]:
        """Return the names of its conditions."""
        return tuple(self.manifest["conditions"])

    def layouts(self, conditions: str) -> Iterator[Layout]:
        """Yield the layouts of one of its conditions, by seed.

        Raises:
            BadInput: It has no such conditions.
        """
        if conditions not in self.conditions:
            raise BadInput(f"{self.folder}: has no {conditions!r}; it has {', '.join(self.conditions)}")
        yield from map(read_layout, layout_files(self.folder / conditions))

    def meshes(self) -> dict[str, Mesh]:
        """Return its objects by name."""
        return {mesh.name: mesh for mesh in load_folder(self.folder / "objects")}


def load_dataset(folder: str | Path, *, verify: bool = True) -> Dataset:
    """Open a published dataset.

    Args:
        folder: Folder with its dataset.json.
        verify: Compare the SHA-256 of every file.

    Raises:
        BadInput: It is no dataset, of another format, or a file is missing or was changed.
    """
    folder = Path(folder)
    if not (folder / MANIFEST).is_file():
        raise BadInput(f"{folder}: is not a dataset (it has no {MANIFEST}); make one with glotouch bench dataset")
    manifest = read_json(folder / MANIFEST)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise BadInput(f"{folder / MANIFEST}: is not of the format {FORMAT}")
    for name, digest in manifest["files"].items() if verify else ():
        path = folder / name
        if not path.is_file():
            raise BadInput(f"{path}: is missing; get the dataset again")
        if _sha256(path) != digest:
            raise BadInput(f"{path}: differs from what {MANIFEST} names; get the dataset again")
    return Dataset(folder, manifest)


def make_dataset(
    campaigns: Sequence[MatchCampaign],
    executor: Executor,
    on_row: OnRow = silent,
    *,
    out: Path,
    name: str,
    version: str,
    command: str,
) -> dict[str, Any]:
    """Touch the layouts of all campaigns, one for each conditions, and write the dataset; return its manifest.

    Args:
        campaigns: Without methods; each in a folder of its own, which is no part of the dataset.
        executor: Runs the trials.
        on_row: Called after each layout.
        out: Folder of the dataset; an earlier one there is replaced.
        name, version: Of the dataset, for the manifest.
        command: The command line, for the README.

    Raises:
        BadInput: A setting cannot be used, or no layout has a TouchSet.
    """
    for campaign in campaigns:
        campaign.check()
    batches = [[campaign.layout_trial(seed) for seed in campaign.seeds] for campaign in campaigns]
    total = sum(map(len, batches))
    done = 0
    for campaign, trials in zip(campaigns, batches, strict=True):

        def told(found: Any, n: int, of: int, before: int = done) -> None:
            on_row(found["layout"], before + n, total)

        run_trials(executor, trials, campaign, told)
        done += len(trials)
    return _write(campaigns, out, {"name": name, "version": version}, command)


def _write(campaigns: Sequence[MatchCampaign], out: Path, head: Mapping[str, Any], command: str) -> dict[str, Any]:
    if out.is_dir():
        shutil.rmtree(out)
    (out / "objects").mkdir(parents=True)
    for stl in stl_files(campaigns[0].folder).values():
        shutil.copyfile(stl, out / "objects" / stl.name)
    for campaign in campaigns:
        shutil.copytree(campaign.out / "touchsets", out / conditions_name(campaign.conditions))
    touchsets = sorted(out.rglob("*.npz"))
    if not touchsets:
        raise BadInput("no object was touched in any layout; see the layouts' result.json for the reasons")
    text = README.format(
        **head,
        count=len(touchsets),
        layouts=len(list(out.glob("*/s*.json"))),
        commit=commit_of_source(),
        command=command,
        columns="\n".join(_columns(touchsets[0])),
    )
    RunFolder(out).write_text("README.md", text)
    files = {str(p.relative_to(out)): _sha256(p) for p in sorted(out.rglob("*")) if p.is_file()}
    profiles = {conditions_name(c.conditions): {"seeds": list(c.seeds), "sampled": c.sampled} for c in campaigns}
    manifest = {
        "format": FORMAT, **head, "commit": commit_of_source(), "command": command, "code": code_versions(),
        "conditions": profiles,
        "objects": sorted(p.stem for p in (out / "objects").iterdir()), "touchsets": len(touchsets),
        "digest": data_digest(files), "files": files,
    }  # fmt: skip
    RunFolder(out).write_text(MANIFEST, json.dumps(manifest, indent=1) + "\n")
    return manifest


def data_digest(files: Mapping[str, str]) -> str:
    """Return one SHA-256 of all data files, by name and content; the README is none of them."""
    lines = (f"{digest}  {name}\n" for name, digest in sorted(files.items()) if name != "README.md")
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _columns(path: Path) -> Iterator[str]:
    """Yield one table row a column of a TouchSet's file; the meaning is that of the field's docstring."""
    own = {
        "version": "version of this file's format",
        "sequence.layers": "number of layers of each sequence",
    }
    with np.load(path) as file:
        for name in sorted(file.files):
            part, _, field = name.partition(".")
            meaning = own.get(name) or _meaning(PARTS[part], field)
            column = file[name]
            kind = "text" if column.dtype.kind == "U" else str(column.dtype)
            rows = "n" if part in ("contact", "sequence", "layer") and column.ndim else None
            shape = " x ".join([*([rows] if rows else []), *map(str, column.shape[bool(rows) :])]) or "1"
            yield f"| `{name}` | {kind} | {shape} | {meaning} |"


def _meaning(cls: type, field: str) -> str:
    """Return the text of a field in the section Attributes of its class's docstring."""
    text = inspect.cleandoc(cls.__doc__ or "")
    found = re.search(rf"^    [\w, ]*\b{field}\b[\w, ]*: (.*(?:\n {{8,}}.*)*)", text, re.MULTILINE)
    return re.sub(r"\s+", " ", found[1]).replace("|", "\\|") if found else ""
