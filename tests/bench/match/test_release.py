"""The published dataset: equal commands give equal data, changes are found, and it is read without this package."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.bench.match import load_dataset
from glotouch_bt.robot import BadInput

SHIPPED = Path(__file__).parents[3] / "glotouch_missions" / "objects"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two releases of the same command, with two objects."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "objects").mkdir()
    for mesh in ("apple.stl", "truck.stl"):
        shutil.copy(SHIPPED / mesh, folder / "objects")
    for name in ("one", "two"):
        words = ["--sampled", "--phases", "1", "--seed", "7", "--workers", "1", "--objects", str(folder / "objects")]
        words += ["--out", str(folder / name), "--json"]
        done = CliRunner().invoke(cli.app, ["bench", "dataset", *words])
        assert done.exit_code == 0, done.output
    return folder


@pytest.mark.study
def test_equal_commands_give_equal_data(made: Path) -> None:
    one, two = (load_dataset(made / name / "dataset") for name in ("one", "two"))
    assert one.manifest["digest"] == two.manifest["digest"]
    assert one.conditions == ("nominal", "realistic")
    (layout,) = one.layouts("nominal")
    assert {t.name for t in layout.touched} == set(layout.objects) == set(one.meshes())
    with pytest.raises(BadInput, match="it has nominal, realistic"):
        list(one.layouts("harsh"))


@pytest.mark.study
def test_numpy_and_json_are_enough_to_read_it(made: Path) -> None:
    """The manifest is checked as sha256sum would, and every column of the README is in the file."""
    folder = made / "one" / "dataset"
    manifest = json.loads((folder / "dataset.json").read_text())
    for name, digest in manifest["files"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    truth = json.loads((folder / "nominal" / "s0007.json").read_text())
    with np.load(folder / "nominal" / truth["candidates"][0]["file"], allow_pickle=False) as file:
        listed = [r.split("|") for r in (folder / "README.md").read_text().splitlines() if r.startswith("| `")]
        assert [r[1].strip(" `") for r in listed] == sorted(file.files)
        assert file["layer.left_m"].shape[0] == file["sequence.layers"].sum() == len(file["layer.aperture_m"])
    assert all(r[4].strip() for r in listed)


@pytest.mark.study
def test_a_changed_file_is_found(made: Path, tmp_path: Path) -> None:
    folder = made / "two" / "dataset"
    (folder / "objects" / "apple.stl").write_bytes(b"x")
    with pytest.raises(BadInput, match=r"apple\.stl: differs"):
        load_dataset(folder)
    (folder / "objects" / "apple.stl").unlink()
    with pytest.raises(BadInput, match="is missing"):
        load_dataset(folder)
    assert load_dataset(folder, verify=False).conditions
    with pytest.raises(BadInput, match="glotouch bench dataset"):
        load_dataset(tmp_path)
