"""The npz of a TouchSet: every bit comes back, and what is not one is refused with its name."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.bench.match.touchset_file import load_touchset, save_touchset
from glotouch_bt.perception.touch import Candidate, Contact, Contour, Layer, TouchSequence, TouchSet
from glotouch_bt.robot import BadInput


def same(a: object, b: object) -> bool:
    """Equal in type, shape and every bit; NaN equals NaN."""
    if type(a) is not type(b):
        return False
    if dataclasses.is_dataclass(a):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    return a == b or (a != a and b != b)


def a_touchset(
    rng: np.random.Generator, sequences: tuple[int, ...] = (2, 1), contacts: int = 3, pad: tuple[int, int] = (7, 5)
) -> TouchSet:
    def layer() -> Layer:
        left, right = rng.normal(0, 1e-3, (2, *pad))
        left[rng.random(pad) < 0.1] = np.nan
        xy, yaw = rng.normal(0, 0.1, 2), float(rng.normal())
        why = str(rng.choice(["", "the aperture still moved"]))
        relief = rng.random((2, 2, 7, 5)) if rng.random() < 0.5 else None
        width, rests = float(rng.normal(0.05, 0.01)), bool(rng.random() < 0.5)
        return Layer(0.02, width, xy, yaw, left, right, 9.75, rests, why, slide_m=float(rng.normal()), relief=relief)

    contour = Contour(
        "box", rng.normal(0, 0.1, 2), (0.07, 0.04), float(rng.normal()), 3e-4, rng.normal(0, 1e-3, contacts), "free",
        rng.normal(0, 1e-6, (2, 2)), rng.normal(0, 0.1, (9, 2)),
    )  # fmt: skip
    met = tuple(
        Contact(float(k), *rng.normal(0, 0.1, (3, 3)), rng.normal(0, 0.1, 2), 0.7, rng.normal(0, 1e-3, 2))
        for k in range(contacts)
    )
    squeezed = tuple(TouchSequence(rng.normal(0, 0.1, 2), 0.3 * n, tuple(layer() for _ in range(n))) for n in sequences)
    return TouchSet(Candidate(4, contour, 0.0713, 0.9, met), squeezed)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    sequences=st.lists(st.integers(0, 4), max_size=4),
    contacts=st.integers(0, 5),
    pad=st.tuples(st.integers(1, 9), st.integers(1, 9)),
)
def test_every_bit_comes_back(tmp_path_factory, seed, sequences, contacts, pad):
    file = tmp_path_factory.mktemp("npz") / "t.npz"
    touchset = a_touchset(np.random.default_rng(seed), tuple(sequences), contacts, pad)
    save_touchset(file, touchset)
    assert same(load_touchset(file), touchset)


def test_a_circle_without_covariance_or_boundary(tmp_path):
    contour = Contour("round", np.zeros(2), (0.06, 0.06), 0.0, 1e-4, np.zeros(0))
    touchset = TouchSet(Candidate(0, contour, 0.07, 1.0, ()), ())
    save_touchset(tmp_path / "t.npz", touchset)
    assert same(load_touchset(tmp_path / "t.npz"), touchset)


def test_the_same_touchset_is_the_same_file(tmp_path):
    for name in ("a.npz", "b.npz"):
        save_touchset(tmp_path / name, a_touchset(np.random.default_rng(5)))
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_depth_maps_of_two_shapes_are_refused(tmp_path):
    good = a_touchset(np.random.default_rng(0), (1,))
    first = good.layers[0]
    odd = dataclasses.replace(first, left_m=np.zeros((3, 3)))
    bad = TouchSet(good.candidate, (TouchSequence(np.zeros(2), 0.0, (first, odd)),))
    with pytest.raises(BadInput, match=r"layer\.left_m: its rows differ in shape"):
        save_touchset(tmp_path / "t.npz", bad)
    assert list(tmp_path.iterdir()) == []


BAD = {
    "no version": ({"version": None}, "no version"),
    "another version": ({"version": np.array(2)}, "version 2; this release reads version 1"),
    "a depth map that is no map": ({"layer.left_m": np.zeros((3, 7))}, r"layer\.left_m: every row must be n x n, is 7"),
    "a point of three": ({"sequence.position_K_m": np.zeros((2, 3))}, r"sequence\.position_K_m: every row must be 2"),
    "a number that is a list": (
        {"layer.aperture_m": np.zeros((3, 2))},
        r"layer\.aperture_m: every row must be a singl",
    ),
    "too few rows": ({"layer.yaw_rad": np.zeros(2)}, "layer: must have 3 rows, has 2, 3"),
    "too many layers": ({"sequence.layers": np.array([2, 2])}, "layer: must have 4 rows"),
    "fewer than no layers": ({"sequence.layers": np.array([4, -1])}, "one count a sequence"),
    "two candidates": ({"candidate.index": np.array([1, 2])}, "candidate: must have 1 rows"),
    "a column gone": ({"layer.force_N": None}, r"layer\.force_N: is missing"),
    "words for numbers": (
        {"layer.height_m": np.array(["a", "b", "c"])},
        r"layer\.height_m: must be an array of floats",
    ),
    "numbers for truth": ({"layer.stable": np.zeros(3)}, r"layer\.stable: must be an array of truth values"),
    "numbers for words": ({"contour.kind": np.zeros(1)}, r"contour\.kind: must be an array of words"),
}


@pytest.mark.parametrize(("change", "message"), BAD.values(), ids=BAD.keys())
def test_wrong_columns_are_refused_by_name(tmp_path, change, message):
    file = tmp_path / "t.npz"
    save_touchset(file, a_touchset(np.random.default_rng(1)))
    with np.load(file) as f:
        columns = {k: f[k] for k in f.files} | change
    np.savez(file, **{k: v for k, v in columns.items() if v is not None})
    with pytest.raises(BadInput, match=message) as told:
        load_touchset(file)
    assert "t.npz" in str(told.value)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut", b"solid", b"\x93NUMPY"])
def test_other_files_are_refused(tmp_path: Path, content):
    (tmp_path / "t.npz").write_bytes(content)
    with pytest.raises(BadInput, match=r"t\.npz: is not a readable TouchSet file"):
        load_touchset(tmp_path / "t.npz")
    with pytest.raises(BadInput, match="not a readable"):
        load_touchset(tmp_path / "gone.npz")


def test_pickles_and_plain_arrays_are_refused(tmp_path):
    np.save(tmp_path / "plain.npy", np.zeros(3))
    np.savez(tmp_path / "pickle.npz", version=np.array([{}], dtype=object))
    for name in ("plain.npy", "pickle.npz"):
        with pytest.raises(BadInput, match="not a readable"):
            load_touchset(tmp_path / name)


def test_a_file_from_before_a_field_is_read_with_its_default(tmp_path):
    file = tmp_path / "t.npz"
    touchset = a_touchset(np.random.default_rng(2))
    save_touchset(file, touchset)
    with np.load(file) as f:
        columns = {k: f[k] for k in f.files if k != "contact.pushed_K_m"}
    np.savez(file, **columns)
    assert all((c.pushed_K_m == 0).all() for c in load_touchset(file).candidate.contacts)
