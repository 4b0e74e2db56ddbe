"""The section of the wrist force: the whole trace, and each contact stop in detail."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from glotouch_bt.report.page import esc, legend, number, section
from glotouch_bt.report.run_record import RecordedEvent, RunRecord
from glotouch_bt.report.svg import AxisScale, label, picture, polyline, x_axis, y_axis
from glotouch_bt.robot import Array

BINS = 1000
"""Points of a trace."""
MAX_CLOSE_UPS = 48
"""Contact stops shown in detail."""
CLOSE_UP_S = 0.12
"""Time shown before and after an onset."""


def contact_of(event: RecordedEvent) -> dict[str, Any]:
    """Return the contact of an event, or an empty dict."""
    value = event.data.get("contact")
    return value if isinstance(value, dict) else {}


def contact_stamp_s(event: RecordedEvent) -> float:
    """Return the robot clock at the onset of an event's contact."""
    stamp = contact_of(event).get("stamp_s")
    return float(stamp) if isinstance(stamp, int | float) else event.stamp_s


def envelope(stamp_s: Array, value: Array, bins: int) -> tuple[Array, Array, Array, Array]:
    """Return time (m,), minimum, median and maximum of `value` in at most `bins` equal intervals of samples."""
    edges = np.unique(np.linspace(0, len(value), min(bins, len(value)) + 1).astype(int))
    low = np.minimum.reduceat(value, edges[:-1])
    high = np.maximum.reduceat(value, edges[:-1])
    middle = (edges[:-1] + edges[1:]) // 2
    median = np.array([np.median(value[a:b]) for a, b in pairwise(edges)])
    return stamp_s[middle], low, median, high


def tared_force(record: RunRecord) -> tuple[Array, Array]:
    """Return time (n,) s and the magnitude (n,) N of the wrist's force since the first tare.

    Before it, the sensor reads the hand's weight. In a run without a tare, all of it is returned.
    """
    if not len(record.samples.get("stamp_s", ())):
        return np.zeros(0), np.zeros(0)
    stamp, force = record.samples["stamp_s"], np.linalg.norm(record.samples["force_S_N"], axis=1)
    tares = {e.data.get("number") for e in record.of_kind("request") if e.data.get("request") == "Tare"}
    ended = [e for e in record.of_kind("request_done") if e.data.get("number") in tares]
    done = [e.stamp_s for e in ended if not e.data.get("error")]
    first = int(np.searchsorted(stamp, min(done), side="right")) if done else 0
    return stamp[first:], np.nan_to_num(force[first:])


def force_section(record: RunRecord) -> str:
    """Return the section, or nothing if no force was recorded."""
    stamp, force = tared_force(record)
    if len(stamp) < 2:
        return ""
    contacts = record.of_kind("contact")
    body = _trace(record, stamp, force, contacts)
    keys = [("k-force", "magnitude of the wrist force |F|, minimum to maximum of each interval")]
    if contacts:
        keys.append(("k-contact", f"contact stop ({len(contacts)})"))
    body += legend(keys)
    if contacts:
        body += _close_ups(record.samples["stamp_s"], record.samples["force_S_N"], contacts)
    lead = (
        "The force felt at the wrist since the first tare, relative to the last one. Each dot is a contact stop. "
        "The chart below shows the opening of the jaws."
    )
    return section("Force", lead, body)


def _trace(record: RunRecord, stamp: Array, force: Array, contacts: list[RecordedEvent]) -> str:
    width, left, right = 1060.0, 46.0, 1050.0
    top, bottom = 34.0, 214.0
    x = AxisScale(float(stamp[0]), float(stamp[-1]), left, right)
    y = AxisScale(0.0, max(float(force.max()) * 1.12, 1.0), bottom, top)
    t, low, _, high = envelope(stamp, force, BINS)
    px = x(t)
    out = [x_axis(x, top, bottom, ""), y_axis(y, left, right, "force, N")]
    band = "fill:var(--blue);fill-opacity:.32;stroke:none"
    out.append(polyline(np.concatenate([px, px[::-1]]), np.concatenate([y(high), y(low)[::-1]]), band, closed=True))
    out.append(polyline(px, y(high), "fill:none;stroke:var(--blue);stroke-width:1;stroke-linejoin:round"))
    peak = int(np.argmax(force))
    peak_x, peak_y = x.at(float(stamp[peak])), y.at(float(force[peak]))
    anchor = "e" if peak_x > 0.8 * right else ""
    shift = -7 if anchor else 7
    for e in contacts:
        at = contact_stamp_s(e)
        if stamp[0] <= at <= stamp[-1]:
            size = contact_of(e).get("force_N")
            felt = float(size) if isinstance(size, int | float) else float(np.interp(at, stamp, force))
            cx = x.at(at)
            out.append(f'<line x1="{cx:.1f}" x2="{cx:.1f}" y1="{bottom}" y2="{bottom + 5}" stroke="var(--contact)"/>')
            out.append(
                f'<circle cx="{cx:.1f}" cy="{y.at(min(felt, y.high)):.1f}" r="3.2" fill="var(--contact)" '
                f'stroke="var(--card)"><title>contact at {at:.2f} s: {felt:.2f} N</title></circle>'
            )
    out.append(f'<circle cx="{peak_x:.1f}" cy="{peak_y:.1f}" r="3" fill="none" stroke="var(--ink)"/>')
    out.append(label(peak_x + shift, peak_y - 5, f"felt peak {force[peak]:.1f} N", f"ink s halo {anchor}".strip()))
    height = bottom + 34
    cycles = record.cycles
    if len(cycles.get("stamp_s", ())) > 1:
        top2, bottom2 = bottom + 52, bottom + 122
        aperture = np.nan_to_num(cycles["gripper_aperture_m"]) * 1e3
        y2 = AxisScale(0.0, max(float(aperture.max()) * 1.1, 1.0), bottom2, top2)
        out.append(x_axis(x, top2, bottom2, "robot clock, s"))
        out.append(y_axis(y2, left, right, "jaw opening, mm", about=3))
        t2, low2, median2, high2 = envelope(cycles["stamp_s"], aperture, BINS)
        edge = np.where(high2 - median2 > median2 - low2, high2, low2)  # keeps the turning points
        out.append(polyline(x(t2), y2(edge), "fill:none;stroke:var(--t1);stroke-width:1.4"))
        height = bottom2 + 40
    return picture(width, height, "".join(out), "wrist force over time with contact stops")


def _close_ups(stamp: Array, force_S_N: Array, contacts: list[RecordedEvent]) -> str:
    """Return one small chart per contact: the force change around the onset."""
    figures: list[str] = []
    for i, e in enumerate(contacts[:MAX_CLOSE_UPS]):
        at = contact_stamp_s(e)
        a, b = np.searchsorted(stamp, [at - CLOSE_UP_S, at + CLOSE_UP_S])
        if b - a < 4:
            continue
        force = np.nan_to_num(force_S_N[a:b])
        before = stamp[a:b] < at - 0.02
        change = np.linalg.norm(force - (force[before].mean(axis=0) if before.any() else force[0]), axis=1)
        x = AxisScale(-CLOSE_UP_S, CLOSE_UP_S, 2, 148)
        y = AxisScale(0.0, max(float(change.max()) * 1.1, 1.0), 52, 6)
        step = max(1, len(change) // 120)
        body = (
            '<line x1="2" x2="148" y1="52" y2="52" class="axis"/>'
            '<line x1="75" x2="75" y1="4" y2="52" stroke="var(--contact)" stroke-dasharray="2 2"/>'
            + polyline(x(stamp[a:b:step] - at), y(change[::step]), "fill:none;stroke:var(--blue);stroke-width:1.2")
        )
        size = contact_of(e).get("force_N")
        text = f"<b>{i + 1}</b> · {at:.1f} s · stop at {number(size, 1, 'N')} · peak {change.max():.1f} N"
        figures.append(
            f"<figure>{picture(150, 56, body, 'contact ' + str(i + 1))}<figcaption>{text}</figcaption></figure>"
        )
    if not figures:
        return ""
    more = f" The first {MAX_CLOSE_UPS} of {len(contacts)} are shown." if len(contacts) > MAX_CLOSE_UPS else ""
    return (
        f"<details open><summary>Contact stops close up: force change from {esc(int(CLOSE_UP_S * 1e3))} ms before to "
        f"{int(CLOSE_UP_S * 1e3)} ms after each onset (dashed).{more}</summary>"
        f'<div class="sparks">{"".join(figures)}</div></details>'
    )
