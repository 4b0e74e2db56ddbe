"""The section of the map: the container from above with path, contacts, fitted contours, jaws, and the truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from glotouch_bt.report.contours import contour_of
from glotouch_bt.report.page import esc, legend, number, section, table
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.sections.force import contact_of
from glotouch_bt.report.svg import AxisScale, label, picture, points, polyline
from glotouch_bt.report.truth import TrueOutline, true_outlines
from glotouch_bt.robot import Array

PAD_HALF_WIDTH_M = 0.0086  # for drawing only
PATH_POINTS = 4000


def candidates(record: RunRecord) -> list[dict[str, Any]]:
    """Return the last entry of each candidate that was not forgotten, in order of index."""
    found: dict[int, dict[str, Any]] = {}
    for e in record.of_kind("candidate", "touchset", "forgotten"):
        if e.kind == "forgotten":
            forgotten = e.data.get("candidates")
            found = {i: c for i, c in found.items() if not isinstance(forgotten, list) or i not in forgotten}
            continue
        holder = e.data.get("touchset") if e.kind == "touchset" else e.data
        c = holder.get("candidate") if isinstance(holder, dict) else None
        if isinstance(c, dict) and isinstance(c.get("index"), int) and contour_of(c) is not None:
            found[c["index"]] = c
    return [found[i] for i in sorted(found)]


def tip_path_K_m(record: RunRecord) -> Array:
    """Return the path (n, 3) of the probe's ball in K while it was held; NaN rows are gaps; (0, 3) if unknown."""
    nothing = np.zeros((0, 3))
    pose, stamp = record.pose_B_K, record.samples.get("stamp_s")
    if pose is None or stamp is None or len(stamp) == 0:
        return nothing
    step = max(1, len(stamp) // (4 * PATH_POINTS))
    t, position, quat = (record.samples[k][::step] for k in ("stamp_s", "position_B_P", "quat_B_P"))
    w, x, y, z = quat.T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    length = np.full(len(t), np.nan)
    for e in record.of_kind("tool"):
        held = e.data.get("grasp_to_tip_m")
        length[t >= e.stamp_s] = held if isinstance(held, int | float) and e.data.get("held", True) else np.nan
    tip = pose.inverse().apply(position + length[:, None] * axis)
    return tip[:: max(1, len(tip) // PATH_POINTS)]


def map_section(record: RunRecord) -> str:
    """Return the map and the table of candidates; nothing without a container, or if the mission explored nothing."""
    interior = record.interior_m
    if interior is None or not record.of_kind("sweep", "candidate", "touchset"):
        return ""
    truth = true_outlines(record)
    found = candidates(record)
    lead = (
        "The container from above (x to the right, y up, millimetres from its middle). The grey line is the path of "
        "the probe's ball; outlines are fitted to its contacts."
    )
    if truth:
        lead += " Green shows the true outlines, which are known in simulation only and used in this report only."
    return section("Map", lead, _picture(record, interior, found, truth) + _table(found, truth))


def _picture(
    record: RunRecord, interior: tuple[float, float, float], found: list[dict[str, Any]], truth: list[TrueOutline]
) -> str:
    half_x, half_y, margin = interior[0] / 2, interior[1] / 2, 0.012
    width = 1060.0
    scale = (width - 60) / (2 * (half_x + margin))
    height = 2 * (half_y + margin) * scale + 40
    x = AxisScale(-half_x - margin, half_x + margin, 44, width - 16)
    y = AxisScale(-half_y - margin, half_y + margin, height - 34, 6)
    left, right, low, high = x.at(-half_x), x.at(half_x), y.at(-half_y), y.at(half_y)
    out = []
    for v in AxisScale(-half_x * 1e3, half_x * 1e3, 0, 1).ticks(9):
        px = x.at(v * 1e-3)
        out.append(f'<line x1="{px:.1f}" x2="{px:.1f}" y1="{high:.1f}" y2="{low:.1f}" class="grid"/>')
        out.append(label(px, low + 28, f"{v:.0f}".replace("-", "−"), "m"))
    for v in AxisScale(-half_y * 1e3, half_y * 1e3, 0, 1).ticks(7):
        py = y.at(v * 1e-3)
        out.append(f'<line x1="{left:.1f}" x2="{right:.1f}" y1="{py:.1f}" y2="{py:.1f}" class="grid"/>')
        out.append(label(left - 14, py + 4, f"{v:.0f}".replace("-", "−"), "e"))
    out.append(
        f'<rect x="{left:.1f}" y="{high:.1f}" width="{right - left:.1f}" height="{low - high:.1f}" rx="2" fill="none" '
        'stroke="var(--soft)" stroke-width="5"/>'
    )
    keys: list[tuple[str, str]] = []
    path = _path(record, x, y, interior)
    if path:
        out.append(path)
        keys.append(("k-path", "path of the probe's ball"))
    true_style = "fill:none;stroke:var(--truth);stroke-width:2;"
    for o in truth:
        out.append(
            polyline(x(o.start_K_m[:, 0]), y(o.start_K_m[:, 1]), true_style + "stroke-dasharray:6 4", closed=True)
        )
        if o.end_K_m is not None and o.moved_m > 0.002:
            end = o.end_K_m
            out.append(
                polyline(x(end[:, 0]), y(end[:, 1]), true_style + "stroke-dasharray:1 4;opacity:.8", closed=True)
            )
    if truth:
        keys.append(("k-truth", "true outline at the start"))
        if any(o.end_K_m is not None and o.moved_m > 0.002 for o in truth):
            keys.append(("k-moved", "true outline at the end, where it moved"))
    jaws = _jaws(record, x, y)
    names: list[str] = []
    for c in found:
        contour = contour_of(c)
        assert contour is not None
        outline = contour.outline_K_m()
        style = "fill:var(--wash);stroke:var(--blue);stroke-width:2"
        out.append(polyline(x(outline[:, 0]), y(outline[:, 1]), style, closed=True))
        cx, cy = x.at(float(contour.centre_K_m[0])), y.at(float(contour.centre_K_m[1]))
        names.append(label(cx, cy + 1, f"candidate {c['index']}", "ink b m halo"))
        size = contour.size_m
        extent = f"⌀ {size[0] * 1e3:.0f}" if contour.kind == "round" else f"{size[0] * 1e3:.0f} × {size[1] * 1e3:.0f}"
        names.append(label(cx, cy + 16, f"{extent} mm", "s m halo"))
    if found:
        keys.append(("k-fit", "fitted contour"))
    out.extend(jaws)
    if jaws:
        keys.append(("k-jaw", "pads where the jaws closed"))
    touches = 0
    for e in record.of_kind("contact"):
        p = _pair(contact_of(e).get("point_K_m"))
        if p is not None:
            touches += 1
            out.append(
                f'<circle cx="{x.at(p[0]):.1f}" cy="{y.at(p[1]):.1f}" r="3.4" fill="var(--contact)" '
                f'stroke="var(--card)"><title>contact {touches} at {e.stamp_s:.1f} s</title></circle>'
            )
    if touches:
        keys.append(("k-contact", f"contact ({touches})"))
    for o in truth:
        top = float(y(o.start_K_m[:, 1]).min())
        out.append(
            f'<text x="{x.at(float(o.centre_K_m[0])):.1f}" y="{top - 7:.1f}" class="b m halo" '
            f'style="fill:var(--truth)">{esc(o.name)}</text>'
        )
    return picture(width, height, "".join(out + names), "map of the container") + (legend(keys) if keys else "")


def _path(record: RunRecord, x: AxisScale, y: AxisScale, interior: tuple[float, float, float]) -> str:
    """Return the probe's path inside the container, with gaps where it leaves it."""
    tip = tip_path_K_m(record)
    if len(tip) == 0 or not np.isfinite(tip).any():
        pieces = [np.asarray(e.data.get("path_K_m") or [], float) for e in record.of_kind("sweep")]
        runs = [p for p in pieces if p.ndim == 2 and len(p) > 1]
    else:
        near = np.isfinite(tip).all(axis=1) & (np.abs(tip[:, 0]) < interior[0] / 2 + 0.02)
        near &= (np.abs(tip[:, 1]) < interior[1] / 2 + 0.02) & (tip[:, 2] < interior[2] + 0.03)
        cuts = np.flatnonzero(np.diff(near.astype(int))) + 1
        runs = [p[:, :2] for p, keep in zip(np.split(tip, cuts), np.split(near, cuts), strict=True) if keep.any()]
    style = "fill:none;stroke:var(--path);stroke-width:1.1;stroke-linejoin:round;opacity:.8"
    return "".join(f'<polyline points="{points(x(p[:, 0]), y(p[:, 1]))}" style="{style}"/>' for p in runs if len(p) > 1)


def _jaws(record: RunRecord, x: AxisScale, y: AxisScale) -> list[str]:
    """Return the two pads of the first closure of each sequence, as lines along x_P."""
    out: list[str] = []
    for e in record.of_kind("touchset"):
        touchset = e.data.get("touchset")
        for sequence in touchset.get("sequences") or [] if isinstance(touchset, dict) else []:
            for layer in (sequence.get("layers") or [])[:1]:
                p, yaw, opening = _pair(layer.get("position_K_m")), layer.get("yaw_rad"), layer.get("aperture_m")
                if p is None or yaw is None or opening is None:
                    continue
                along, across = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
                for side in (0.5, -0.5):
                    ends = p + side * opening * across + np.outer([-1, 1], PAD_HALF_WIDTH_M * along)
                    style = "stroke:var(--t1);stroke-width:3;stroke-linecap:round;opacity:.9"
                    out.append(polyline(x(ends[:, 0]), y(ends[:, 1]), style))
    return out


def _pair(value: object) -> Array | None:
    try:
        p = np.asarray(value, dtype=np.float64).ravel()[:2]
    except (TypeError, ValueError):
        return None
    return p if p.shape == (2,) and np.isfinite(p).all() else None


def _table(found: list[dict[str, Any]], truth: list[TrueOutline]) -> str:
    if not found:
        return "<p>No object was found.</p>"
    head = ["candidate", "class"] + (["true object"] if truth else [])
    first_number = len(head)
    head += ["x, y (mm)", "size (mm)", "yaw", "height (mm)", "fit rms (mm)", "contacts", "quality"]
    head += ["centre off (mm)"] if truth else []
    rows = []
    for c in found:
        contour = contour_of(c)
        assert contour is not None
        size, centre = contour.size_m, contour.centre_K_m
        row = [f"<b>{c['index']}</b>", esc(contour.kind)]
        near = min(truth, key=lambda o: o.distance_m(centre), default=None)
        if near is not None:
            row.append(esc(near.name))
        both = f"{number(size[0], 1, scale=1e3)} × {number(size[1], 1, scale=1e3)}"
        row += [
            f"{number(float(centre[0]), 1, scale=1e3)}, {number(float(centre[1]), 1, scale=1e3)}",
            f"⌀ {number(size[0], 1, scale=1e3)}" if contour.kind == "round" else both,
            "–" if contour.kind == "round" else number(float(np.rad2deg(contour.yaw_rad)), 0) + "°",
            number(c.get("height_m") if c.get("top_touched", True) else None, 1, scale=1e3),
            number(contour.rms_m, 2, scale=1e3),
            str(len(c.get("contacts") or [])),
            number(c.get("quality"), 2),
        ]
        if near is not None:
            row.append(number(near.distance_m(centre), 1, scale=1e3))
        rows.append(row)
    said = "Height: of objects whose top was touched. "
    said += "Quality: certainty of the centre, 0.5 at a standard deviation of 5 mm."
    if truth:
        said += " Centre off: from the middle of the true outline, at the start or the end of the run."
    return "<h3>Candidates</h3>" + table(head, rows, numeric_from=first_number) + f"<p>{said}</p>"
