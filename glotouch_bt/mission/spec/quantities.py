"""Scalars with a unit, written as text (`40 mm`) or declared by a mission parameter."""

from __future__ import annotations

from dataclasses import replace

from glotouch_bt.mission.spec.findings import Findings
from glotouch_bt.mission.spec.source import Map, Node, Scalar
from glotouch_bt.mission.spec.units import UNITS, base_of, convert, split_quantity


def measured(given: Scalar) -> Scalar:
    """Split `40 mm` into a number and its unit; return anything else unchanged."""
    quantity = split_quantity(given.value) if isinstance(given.value, str) else None
    return replace(given, value=quantity[0], unit=quantity[1]) if quantity else given


def compared(given: Map, findings: Findings) -> tuple[Map, str]:
    """Convert the number of a comparison to SI; return the comparison and the SI unit of a number with a unit."""
    base = ""
    entries: list[tuple[Scalar, Node]] = []
    for key, value in given.entries:
        if key.value in ("equals", "at_least", "at_most") and isinstance(value, Scalar):
            value = measured(value)
            if value.unit and isinstance(value.value, (int, float)) and not isinstance(value.value, bool):
                if value.unit in UNITS:
                    base = base_of(value.unit)
                    value = replace(value, value=convert(value.value, value.unit, base), unit="", span=None)
                else:
                    findings.unknown(value.place, "wrong_unit", "unit", value.unit, UNITS)
                    value = replace(value, poisoned=True)
        entries.append((key, value))
    return replace(given, entries=tuple(entries)), base
