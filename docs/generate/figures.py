"""Figures of a summary.json: their place, and their text with the interval."""

from __future__ import annotations

from typing import Any


def value_at(summary: Any, *paths: str) -> Any:
    """Return the value at a path of keys (numbers in lists) separated by slashes, or None."""
    for key in [k for path in paths for k in path.split("/") if k]:
        if isinstance(summary, list) and key.isdecimal() and int(key) < len(summary):
            summary = summary[int(key)]
        elif isinstance(summary, dict) and key in summary:
            summary = summary[key]
        else:
            return None
    return summary


def figure(value: Any, row: dict[str, Any]) -> str:
    """Return a figure with its interval: a rate in per cent, a mean or a quantile, or a plain number."""
    if value is None:
        return ""
    unit, digits = row.get("unit", ""), row.get("digits", 2)
    after = f" {unit}" if unit else ""
    if isinstance(value, dict) and "rate" in value and "hours" not in value:
        n, rate = value["n"], value["rate"]
        return f"{round(rate * n)}/{n} = {_percent(rate)} % [{_percent(value['lo'])}, {_percent(value['hi'])}]"
    if isinstance(value, dict) and "count" in value:
        return f"{value['count']} ({value['lo']:.2g}-{value['hi']:.2g} an hour)"
    if isinstance(value, dict):
        middle = next(value[k] for k in ("mean", "value", "median", "r", "difference") if k in value)
        interval = f" [{value['lo']:.{digits}f}, {value['hi']:.{digits}f}]" if value.get("lo") is not None else ""
        between = f" ({value['min']:.{digits}f} to {value['max']:.{digits}f})" if "min" in value else ""
        return f"{middle:.{digits}f}{after}{interval}{between}"
    if isinstance(value, list):
        return str(len(value))
    return f"{value:.{digits}f}{after}" if isinstance(value, float) else f"{value}{after}"


def _percent(share: float) -> str:
    percent = round(100 * share, 9)
    return f"{percent:.1g}" if 0 < percent < 0.05 else f"{percent:.1f}".removesuffix(".0")
