"""The section of the 3D scene, which plays the run in the browser. The only section that needs a script."""

from __future__ import annotations

import numpy as np

from glotouch_bt.report.page import section
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.scene import scene_data, scene_json
from glotouch_bt.report.sections.force import contact_stamp_s, envelope
from glotouch_bt.report.sections.header import parameter
from glotouch_bt.report.state import read_setup
from glotouch_bt.report.svg import AxisScale, polyline

STRIP_BINS = 600
"""Points of the strip above the slider."""
SCENE_ID = 'id="scene-data"'
"""Marks the element with the data of the scene; a page that has it needs the script."""
_BOXES = (("contacts", "contacts"), ("candidates", "candidates"))


def scene_section(record: RunRecord) -> str:
    """Return the scene with its slider, or nothing if the record describes no robot."""
    data = scene_data(record, read_setup(record, record.objects))
    if data is None:
        return ""
    boxes = "".join(f'<label><input type="checkbox" id="show-{n}" checked> {title}</label>' for n, title in _BOXES)
    if data["ghosts"]:
        words = ("hidden", "at the start", "at the end")
        options = "".join(f'<option value="{i - 1}">{word}</option>' for i, word in enumerate(words))
        boxes += f'<label>true objects <select id="show-truth">{options}</select></label>'
    lead = (
        "Drag to turn, scroll or pinch to zoom, drag with the right button to move. The number at a candidate is its "
        "index."
    )
    if record.result.get("target") or parameter(record, "target"):
        lead += (
            " The percentage is the probability that it is the target. The green solid is the target where it was "
            "recognised."
        )
    body = (
        '<div id="scene-box"><div class="stage"><canvas id="scene"></canvas><div id="scene-names"></div>'
        '<p class="facts over-scene"><b id="scene-time"></b> <span id="scene-skill"></span> '
        '<span id="scene-force"></span></p>'
        '<p class="no-gl">This browser shows no WebGL. The rest of the page needs none.</p></div>'
        f'<div class="play"><button id="scene-play">play</button><div>{_strip(record)}'
        '<input type="range" id="scene-slider" aria-label="robot clock, s"></div>'
        '<select id="scene-speed" aria-label="speed">'
        + "".join(f'<option value="{v}"{" selected" if v == 10 else ""}>{v}×</option>' for v in (1, 2, 5, 10, 30))
        + f'</select></div><div class="boxes">{boxes}</div>'
        "<noscript><p>The scene needs a script, the rest of the page does not.</p></noscript></div>"
        f'<script type="application/json" {SCENE_ID}>{scene_json(data)}</script>'
    )
    return section("Scene", lead, body)


def _strip(record: RunRecord) -> str:
    """Return the wrist force of the whole run with its contacts and failures, as wide as the slider."""
    stamp = record.samples["stamp_s"]
    force = np.nan_to_num(np.linalg.norm(record.samples["force_S_N"], axis=1))
    start, end = record.span_s
    x, y = AxisScale(start, end, 0.0, 1000.0), AxisScale(0.0, max(float(force.max()), 1.0), 40.0, 2.0)
    t, _, _, high = envelope(stamp, force, STRIP_BINS)
    out = [polyline(x(t), y(high), "fill:none;stroke:var(--blue);stroke-width:1;vector-effect:non-scaling-stroke")]
    for e in record.of_kind("contact", "failure"):
        colour, top = ("var(--bad)", 0) if e.kind == "failure" else ("var(--contact)", 36)
        at = x.at(contact_stamp_s(e))
        out.append(f'<path d="M{at:.1f} {top}V44" stroke="{colour}" vector-effect="non-scaling-stroke"/>')
    return (
        f'<svg class="strip" viewBox="0 0 1000 44" preserveAspectRatio="none" aria-hidden="true">{"".join(out)}</svg>'
    )
