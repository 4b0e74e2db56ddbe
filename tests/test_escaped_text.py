"""Control sequences and markup in foreign text are escaped; names with invisible characters are refused."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET

import pytest

from glotouch_bt.escaped_text import fault_of_name, fault_of_text, html_text, json_text, visible, xml_text

ODD = [
    ("\x1b[31m", "\\x1b[31m"),
    ("\x1b]8;;http://x\x07y", "\\x1b]8;;http://x\\x07y"),
    ("a\rb", "a\\rb"),
    ("\x9b2J", "\\x9b2J"),
    ("\u202egpj", "\\u202egpj"),
    ("a\u2028b", "a\\u2028b"),
    ("\udc80", "\\udc80"),
    ("\x00", "\\x00"),
]


@pytest.mark.parametrize(("text", "shown"), ODD)
def test_control_characters_are_shown(text: str, shown: str) -> None:
    assert visible(text) == visible(visible(text)) == shown
    assert "control character" in fault_of_text(text)
    assert "control character" in fault_of_name(text)
    assert html_text(text) == shown
    assert ET.fromstring(ET.tostring(ET.Element("a", name=xml_text(text)))).get("name") == shown
    assert json.loads(json_text({"a": text}))["a"] == text
    assert json_text(text).isascii()


@pytest.mark.parametrize("text", ["plain", "Ünïcode", "日本", "👨‍👩‍👧", "a\\b", "50 %", "[bold]"])
def test_other_text_is_left_alone(text: str) -> None:
    assert visible(text) == text
    assert fault_of_name(text) == fault_of_text(text) == ""


@pytest.mark.parametrize(
    ("name", "why"), [("", "is empty"), (" ", "is empty"), ("a\nb", "line break"), ("a\tb", "tab")]
)
def test_a_name_is_one_line(name: str, why: str) -> None:
    assert why in fault_of_name(name)
    assert fault_of_text(name) == ""


def test_html_is_escaped_once() -> None:
    assert html_text('<a href="x">&') == "&lt;a href=&quot;x&quot;&gt;&amp;"
