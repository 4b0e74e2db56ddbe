"""Kept values: round trips of everything that may be kept, refusal of everything else, and no code from a file."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections import deque
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from py_trees.common import Status

from glotouch_bt.mission.checkpoint.codec import Encoder, NotEncodable, decode, encode
from glotouch_bt.perception.touch import Contact, Contour
from glotouch_bt.robot import BadInput, GripperState, Pose
from glotouch_bt.skill import Reason
from tests.support.examples import examples


def same(a: Any, b: Any) -> bool:
    """Equal to the bit, in type, dtype, order, NaN payload and flags."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return (
            a.dtype == b.dtype
            and a.shape == b.shape
            and a.tobytes() == b.tobytes()
            and a.flags.writeable == b.flags.writeable
            and (a.flags.f_contiguous == b.flags.f_contiguous or not (a.flags.c_contiguous or a.flags.f_contiguous))
        )
    if isinstance(a, np.generic):
        return a.dtype == b.dtype and a.tobytes() == b.tobytes()
    if isinstance(a, float):
        return np.float64(a).tobytes() == np.float64(b).tobytes()
    if isinstance(a, (tuple, list, deque)):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if dataclasses.is_dataclass(a):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    return bool(a == b)


numbers = st.one_of(st.integers(), st.floats(), st.booleans(), st.none(), st.text(max_size=8), st.binary(max_size=8))
dtypes = st.sampled_from([np.float64, np.float32, np.int64, np.int32, np.uint8, np.bool_, np.complex128])
arrays = dtypes.flatmap(lambda d: hnp.arrays(d, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)))


evidence = st.one_of(st.integers(), st.floats(), st.booleans(), st.text(max_size=8))


def _reason(parts: Any) -> Reason:
    return Reason("code", "text", parts)


values = st.recursive(
    st.one_of(numbers, arrays),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.lists(inner, max_size=4).map(tuple),
        st.dictionaries(st.text(max_size=4), inner, max_size=4),
        st.lists(inner, max_size=3).map(lambda v: deque(v, maxlen=5)),
        st.dictionaries(st.text(max_size=4), evidence, max_size=3).map(_reason),
    ),
    max_leaves=12,
)


@settings(max_examples=examples(100, 300), deadline=None)
@given(values)
def test_what_may_be_kept_comes_back_to_the_bit(value: Any) -> None:
    assert same(decode(encode(value)), value)


@settings(max_examples=examples(100, 300), deadline=None)
@given(st.binary(max_size=200))
def test_no_bytes_do_more_than_be_refused(data: bytes) -> None:
    with contextlib.suppress(BadInput):
        decode(data)


@settings(max_examples=examples(80, 200), deadline=None)
@given(values, st.integers(0, 10_000), st.integers(0, 255))
def test_a_damaged_value_is_read_or_refused(value: Any, at: int, byte: int) -> None:
    data = bytearray(encode(value))
    data[at % len(data)] = byte
    with contextlib.suppress(BadInput):
        decode(bytes(data))


def test_orders_flags_and_the_values_of_the_house() -> None:
    fortran = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    frozen = np.arange(3.0)
    frozen.setflags(write=False)
    contour = Contour("round", frozen[:2], (0.1, 0.1), 0.0, 1e-4, np.array([math.nan, -0.0]))
    contact = Contact(1.5, frozen, frozen, frozen, frozen[:2], 2.0)
    kept = (fortran, frozen, contour, contact, Pose(np.zeros(3)), GripperState(0.0, 0.1, 2.0, True), np.float32(0.1))
    assert same(decode(encode(kept)), kept)
    assert decode(encode({1, 3, 2})) == {1, 2, 3}
    assert decode(encode(frozenset("ab"))) == frozenset("ab")
    assert decode(encode(2**200)) == 2**200


def test_one_object_stays_one_object() -> None:
    contour = Contour("round", np.zeros(2), (0.1, 0.1), 0.0, 1e-4, np.zeros(0))
    first, second = decode(encode({"a": (contour, contour.centre_K_m), "b": [contour]})).values()
    assert first[0] is second[0]
    assert first[1] is first[0].centre_K_m


def test_equal_numbers_are_not_taken_for_one_object_after_it_is_gone() -> None:
    kept = tuple((float(i), np.full(1, i)) for i in range(100))
    assert same(decode(encode(kept)), kept)


def test_a_generator_goes_on_where_it_was() -> None:
    rng = np.random.default_rng(3)
    rng.standard_normal(7)
    again = decode(encode(rng))
    assert np.array_equal(again.standard_normal(9), rng.standard_normal(9))


def test_sets_give_the_same_bytes_whatever_their_order() -> None:
    assert encode({f"k{i}" for i in range(40)}) == encode({f"k{i}" for i in reversed(range(40))})


@dataclasses.dataclass
class Foreign:
    """Of a package that provides no skill."""

    x: int = 0


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (lambda: 0, "function"),
        (object(), "builtins.object"),
        ({"a": (1, {"b": print})}, "value['a'][1]['b']"),
        (np.array(["text"]), "array of"),
        (np.array([object()], dtype=object), "array of object"),
        (Foreign(), "provides no skill"),
        (Status.RUNNING, "provides no skill"),
    ],
)
def test_what_cannot_be_kept_says_what_and_where(value: object, words: str) -> None:
    with pytest.raises(NotEncodable) as e:
        encode(value)
    assert words in str(e.value)


def test_a_value_that_contains_itself_ends() -> None:
    loop: list[object] = []
    loop.append(loop)
    encode(loop)  # a reference to what is being read: refused or None on reading, never endless
    deep: object = 0
    for _ in range(500):
        deep = (deep,)
    with pytest.raises(NotEncodable):
        encode(deep)


def test_a_value_that_cannot_be_kept_leaves_the_next_one_readable() -> None:
    encoder = Encoder()
    shared = np.arange(3.0)
    with pytest.raises(NotEncodable):
        encoder.plain([shared, print])
    data = msgspec.msgpack.encode(encoder.plain((shared, shared)))
    first, second = decode(data)
    assert first is second


@pytest.mark.parametrize(
    "named",
    ["os:system", "subprocess:Popen", "builtins:eval", "glotouch_bt.skill.base:Skill",
     "glotouch_bt.robot:GlotouchError",
     "glotouch_bt.nowhere:X", "glotouch_bt.skill.base:dataclass", "glotouch_bt.skill.base:Skill.run", "numpy:ndarray"],
)  # fmt: skip
def test_a_file_cannot_name_what_is_no_value(named: str) -> None:
    for plain in (["d", named, ["x", 1]], ["e", named, "x"]):
        with pytest.raises(BadInput):
            decode(msgspec.msgpack.encode(plain))


def test_another_version_of_a_class_is_said_to_be_one() -> None:
    plain = ["d", "glotouch_bt.skill.base:Reason", ["code", "c"], ["words", "w"]]
    with pytest.raises(BadInput, match="another version"):
        decode(msgspec.msgpack.encode(plain))
