"""Scalars that carry a unit: as text (`40 mm`), or from a mission parameter that declares one."""

from __future__ import annotations

from dataclasses import replace

from glotouch_bt.mission.spec.findings import Findings
from glotouch_bt.mission.spec.source import Map, Node, Scalar
from glotouch_bt.mission.spec.units import UNITS, base_of, convert, split_quantity


def measured(given: Scalar) -> Scalar:
    """`40 mm` as a number and its unit; anything else as it is."""
    quantity = split_quantity(given.value) if isinstance(given.value, str) else None
    return replace(given, value=quantity[0], unit=quantity[1]) if quantity else given


def compared(given: Map, findings: Findings) -> tuple[Map, str]:
    """A condition that compares with a plain SI number, and that number's SI unit if it was written with a unit."""
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
