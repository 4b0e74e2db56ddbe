"""The layout for Foxglove and Lichtblick names only what a record has."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from glotouch_bt.mission.record.mcap_schemas import CHANNELS, SCHEMAS

LAYOUT = json.loads((Path(__file__).parents[3] / "docs" / "guides" / "foxglove_layout.json").read_text())


def texts(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inside in value.items():
            yield key
            yield from texts(inside)
    elif isinstance(value, list):
        for inside in value:
            yield from texts(inside)
    elif isinstance(value, str):
        yield value


def test_every_topic_and_field_exists() -> None:
    named = {text for text in texts(LAYOUT["configById"]) if text.startswith("/")}
    assert {"/scene", "/scene/world", "/log", "/wrench.force_N"} <= named
    for text in named:
        topic, *fields = text.split(".")
        schema: Any = SCHEMAS[CHANNELS[topic]]
        for field in fields:
            schema = schema["properties"][field]


def test_every_panel_of_the_layout_has_a_configuration() -> None:
    def panels(part: Any) -> Iterator[str]:
        if isinstance(part, str):
            yield part
        else:
            yield from panels(part["first"])
            yield from panels(part["second"])

    assert sorted(panels(LAYOUT["layout"])) == sorted(LAYOUT["configById"])
