"""YAML reading: places, limits, and everything that is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.mission.read.yaml_source import MAX_DEPTH, parse_yaml, read_yaml
from glotouch_bt.mission.spec.source import Map, Place, Scalar, plain
from glotouch_bt.robot import BadInput
from tests.support.examples import examples


def test_places_count_from_one() -> None:
    root = parse_yaml("a: 1\nb:\n  - x\n  - {y: 2.5}\n", "f")
    assert isinstance(root, Map)
    assert root.key_place("b") == Place("f", 2, 1)
    below = root.get("b")
    assert below is not None
    assert [str(i.place) for i in below.items] == ["f:3:5", "f:4:5"]  # type: ignore[union-attr]
    assert plain(root) == {"a": 1, "b": ["x", {"y": 2.5}]}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1), ("-7", -7), ("1.5", 1.5), ("1e-3", 0.001), ("2.5E+2", 250.0), (".5", 0.5), ("true", True),
        ("False", False), ("~", None), ("null", None), ("yes", "yes"), ("on", "on"), ("'1'", "1"), ('"true"', "true"),
        ("40 mm/s", "40 mm/s"), ("12:30", "12:30"), ("2020-01-01", "2020-01-01"), ("0x1f", "0x1f"), ("$name", "$name"),
    ],
)  # fmt: skip
def test_scalars(text: str, value: object) -> None:
    node = parse_yaml(text, "f")
    assert isinstance(node, Scalar)
    assert node.value == value
    assert type(node.value) is type(value)


@pytest.mark.parametrize(
    ("text", "place", "word"),
    [
        ("a: &x 1\nb: 2", "f:1:4", "anchors"),
        ("a: [1]\nb: *x", "f:2:4", "aliases"),
        ("a: !!python/object/apply:os.system ['true']", "f:1:4", "tags"),
        ("a: !x 1", "f:1:4", "tags"),
        ("a: 1\nb: 2\na: 3", "f:3:1", "duplicate key"),
        ("a: {<<: 1}", "f:1:5", "merge"),
        ("a: 1\n---\nb: 1", "f:2:1", "second document"),
        ("? [1, 2]\n: 3", "f:1:3", "key"),
        ("1: 2", "f:1:1", "key"),
        ("a: [1, 2\nb: 3", "f:2:", "not valid YAML"),
        ("a:\n\t- 1", "f:2:1", "not valid YAML: a tab; indent with blanks"),
        ("a:\n  - b:\n      c: 1\n     d: 2", "f:4:6", "; this line begins in another column than its neighbours"),
        ("a: 1\n  b: 2", "f:2:4", "; begin the line in the column of its neighbours"),
        ("a: .nan", "f:1:4", "finite"),
        ("a: -.inf", "f:1:4", "finite"),
        ("a: 1e999", "f:1:4", "finite"),
        ("", "f", "no YAML document"),
        ("# nothing", "f", "no YAML document"),
        ("a: \x01", "f:1:", ""),
        ("[" * 2000, "f:1:", "nested deeper"),
        ("\n".join(" " * i + "a:" for i in range(200)), f"f:{MAX_DEPTH + 1}:", "nested deeper"),
        ("x" * 1_000_001, "f", "larger than"),
    ],
)
def test_refused_with_its_place(text: str, place: str, word: str) -> None:
    with pytest.raises(BadInput) as e:
        parse_yaml(text, "f")
    assert str(e.value).startswith(place)
    assert word in str(e.value)


def test_a_billion_laughs_is_refused_at_once() -> None:
    bomb = "a: &a [x]\n" + "".join(
        f"{c}: &{c} [{', '.join('*' + p for _ in range(9))}]\n" for p, c in zip("abcdefgh", "bcdefghi", strict=True)
    )
    with pytest.raises(BadInput, match="f:1:4: anchors"):
        parse_yaml(bomb, "f")


def test_not_utf8() -> None:
    with pytest.raises(BadInput, match=r"f:2:4: not UTF-8"):
        parse_yaml(b"a: 1\nb: \xff\n", "f")


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot be read"):
        read_yaml(tmp_path / "none.yaml")
    with pytest.raises(BadInput, match="is a folder"):
        read_yaml(tmp_path)


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**15), 10**15)
    | st.floats(-1e9, 1e9, allow_subnormal=False)
    | st.text("abc xyz", max_size=6),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text("abcdef", min_size=1, max_size=4), inner, max_size=4)
    ),
    max_leaves=12,
)


@settings(max_examples=examples(60, 150), deadline=None)
@given(VALUES)
def test_agrees_with_safe_load(value: object) -> None:
    """What PyYAML writes, both readers read alike (keys that PyYAML would not read as text are refused)."""
    text = yaml.safe_dump(value, default_flow_style=True)
    try:
        assert plain(parse_yaml(text, "f")) == yaml.safe_load(text)
    except BadInput as refused:
        if "key" not in str(refused):
            raise


@settings(max_examples=examples(100, 300), deadline=None)
@given(st.text("ab:-[]{}&*!|>'\"#%@, \n\t01.~?$<", max_size=60) | st.binary(max_size=40))
def test_any_text_is_read_or_refused(text: str | bytes) -> None:
    try:
        parse_yaml(text, "f")
    except BadInput as refused:
        if not str(refused).startswith("f"):
            raise
