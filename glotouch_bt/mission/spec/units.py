"""Units of numbers in YAML: `speed: 40 mm/s` for a parameter in m/s. Plain numbers are SI."""

from __future__ import annotations

import math
import re
from functools import cache

UNITS: dict[str, tuple[str, float]] = {
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 1e-2),
    "mm/s": ("m/s", 1e-3),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180),
    "m/s2": ("m/s2", 1.0),
    "mm/s2": ("m/s2", 1e-3),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "kN": ("N", 1e3),
    "Nm": ("Nm", 1.0),
    "mNm": ("Nm", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "min": ("s", 60.0),
    "kg": ("kg", 1.0),
    "g": ("kg", 1e-3),
    "kg/m3": ("kg/m3", 1.0),
    "Hz": ("Hz", 1.0),
    "kHz": ("Hz", 1e3),
    "%": ("", 1e-2),
}
"""Unit: (its SI unit, factor). The SI unit of angles is the radian."""

SMALLER_UNITS = {"m": "mm", "m/s": "mm/s", "m/s2": "mm/s2", "rad": "deg", "rad/s": "deg/s", "kg": "g", "s": "ms"}
"""The unit in which people think of small values of an SI unit."""

# Longest first: `_m_s` before `_s`.
_SUFFIXES: tuple[tuple[str, str], ...] = (
    ("_m_s2", "m/s2"),
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_mm", "mm"),
    ("_Nm", "Nm"),
    ("_kg", "kg"),
    ("_Hz", "Hz"),
    ("_N", "N"),
    ("_s", "s"),
    ("_m", "m"),
)

_QUANTITY = re.compile(
    r"([-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(?![eE][-+]?[0-9])([A-Za-z%µ][A-Za-z0-9/%^]*)"
)


def split_quantity(text: str) -> tuple[float, str] | None:
    """Split "40 mm/s" into (40.0, "mm/s"); return None if the text is not a number followed by a word like a unit."""
    found = _QUANTITY.fullmatch(text.strip())
    if not found or not math.isfinite(float(found[1])):
        return None
    return float(found[1]), found[2].replace("^", "")


@cache
def unit_of_name(name: str) -> str:
    """Return the unit in the suffix of a name (`weight_N`), or empty."""
    return next((unit for suffix, unit in _SUFFIXES if name.endswith(suffix)), "")


def base_of(unit: str) -> str:
    """Return the SI unit of the same quantity; empty for a plain number or an unknown unit."""
    return UNITS.get(unit, ("", 1.0))[0]


def units_for(unit: str) -> list[str]:
    """Return the units that are valid where `unit` is expected."""
    base = UNITS.get(unit, (unit, 1.0))[0]
    return [u for u, (b, _) in UNITS.items() if b == base] or ([unit] if unit else [])


def convert(value: float, unit: str, expected: str) -> float:
    """Convert a number from `unit` to the expected unit.

    Raises:
        ValueError: The units measure different quantities, or one is unknown.
    """
    if unit == expected:
        return value
    known = {**UNITS, "": ("", 1.0)}
    if unit not in known or expected not in known or known[unit][0] != known[expected][0]:
        raise ValueError(f"{unit!r} is not {expected!r}")
    # Round to 15 digits, so that 40 mm/s is exactly 0.04 m/s.
    return float(f"{value * known[unit][1] / known[expected][1]:.15g}")
