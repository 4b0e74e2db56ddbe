"""Models kept on disk: the same as built, rebuilt when damaged, done without where nothing can be written."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from glotouch_bt.perception import model_cache
from glotouch_bt.perception.model_cache import cache_folder, model_key, target_model
from glotouch_bt.perception.recognition import PadSpec, TargetModel
from glotouch_bt.perception.recognition.model.parts import from_parts, to_parts
from glotouch_bt.robot import ParamError


@pytest.fixture
def mesh(solids):
    return solids.box(0.050, 0.040, 0.045)


@pytest.fixture
def fresh(monkeypatch):
    """Forgets what is mapped in this process."""

    def forget() -> None:
        monkeypatch.setattr(model_cache, "_mapped", type(model_cache._mapped)())

    forget()
    return forget


def same(a: TargetModel, b: TargetModel) -> None:
    np.testing.assert_array_equal(a.width_m, b.width_m)
    np.testing.assert_array_equal(a.images, b.images)
    np.testing.assert_array_equal(a.fine_m, b.fine_m)
    np.testing.assert_array_equal(a.outline.as_box.centre_m, b.outline.as_box.centre_m)
    assert (a.height_m, a.rho, a.anisotropy, a.pad, a.digest) == (b.height_m, b.rho, b.anisotropy, b.pad, b.digest)


def test_kept_and_mapped(tmp_path, mesh, fresh, monkeypatch) -> None:
    built = target_model(mesh, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    fresh()
    monkeypatch.setattr(TargetModel, "from_mesh", classmethod(lambda *_: pytest.fail("built again")))
    mapped = target_model(mesh, folder=tmp_path)
    same(built, mapped)
    assert target_model(mesh, folder=tmp_path) is mapped


@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "header", "other"])
def test_a_damaged_file_is_built_again(tmp_path, mesh, fresh, solids, damage: str) -> None:
    built = target_model(mesh, folder=tmp_path)
    (file,) = tmp_path.iterdir()
    raw = bytearray(file.read_bytes())
    if damage == "empty":
        raw = bytearray()
    elif damage == "cut":
        raw = raw[: len(raw) // 2]
    elif damage == "flipped":
        raw[len(raw) // 2] ^= 0xFF
    elif damage == "header":
        raw[40] ^= 0xFF
    else:
        fresh()
        other = solids.box(0.050, 0.030, 0.040)
        target_model(other, folder=tmp_path / "x")
        raw = bytearray(next((tmp_path / "x").iterdir()).read_bytes())
    file.unlink()  # what is mapped stays mapped
    file.write_bytes(raw)
    fresh()
    same(built, target_model(mesh, folder=tmp_path))
    fresh()
    assert model_cache._read(file, mesh.name) is not None


ABSURD = {
    "reach beyond the mesh": {"reach_m": lambda t: t + np.float32(1.0)},
    "no reach at all": {"reach_m": lambda t: np.full_like(t, np.nan)},
    "infinite reach": {"reach_m": lambda t: np.full_like(t, np.inf)},
    "side images beyond the mesh": {"fine_m": lambda t: np.full_like(t, 9.0)},
    "side images of another size": {"fine_m": lambda t: t[:, :-1]},
    "empty tables": {"reach_m": lambda t: t[:, :0], "z_m": lambda z: z[:0]},
    "other heights": {"z_m": lambda z: z + 0.01},
    "another top": {"height_m": lambda h: h + 0.1},
    "a middle that is not finite": {"centre_m": lambda c: c * np.nan},
    "nonplanarity that is not finite": {"rho": lambda r: float("nan")},
}


@pytest.mark.parametrize("what", ABSURD)
def test_an_absurd_file_is_not_believed(tmp_path, mesh, fresh, what: str) -> None:
    """Its checksums are right."""
    built = target_model(mesh, folder=tmp_path)
    (file,) = tmp_path.iterdir()
    file.unlink()
    built.images  # noqa: B018 - so that the tables are those of the model
    changes = {name: change(getattr(built, name)) for name, change in ABSURD[what].items()}
    model_cache._write(file, dataclasses.replace(built, **changes))
    fresh()
    same(built, target_model(mesh, folder=tmp_path))


def test_a_link_in_the_cache_is_not_followed(tmp_path, mesh, fresh) -> None:
    target_model(mesh, folder=tmp_path)
    (file,) = tmp_path.iterdir()
    file.rename(tmp_path / "elsewhere")
    file.symlink_to(tmp_path / "elsewhere")
    assert model_cache._read(file, mesh.name) is None


def test_a_folder_that_cannot_be_written_is_done_without(tmp_path, mesh, fresh) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    assert target_model(mesh, folder=blocked / "models").digest == mesh.digest


def test_the_key_is_of_content_and_pad(solids, mesh) -> None:
    assert model_key(mesh, PadSpec()) == model_key(solids.box(0.050, 0.040, 0.045), PadSpec())
    assert model_key(mesh, PadSpec()) != model_key(mesh, PadSpec(force_N=20.0))
    assert model_key(mesh, PadSpec()) != model_key(solids.box(0.050, 0.040, 0.046), PadSpec())


def test_the_folder_follows_the_user(monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "glotouch" / "models"


def test_parts_that_do_not_fit_are_refused(mesh) -> None:
    facts, arrays = to_parts(TargetModel.from_mesh(mesh))
    for bad in ({**facts, "version": 0}, {**facts, "l_m": [0.0]}, {k: v for k, v in facts.items() if k != "outlines"}):
        with pytest.raises(ParamError):
            from_parts("x", bad, arrays)
