"""The section of the squeezes: every depth map as a small picture, on one colour scale."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from glotouch_bt.report.page import esc, number, section
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.robot import Array

_DARK = [(6, 6, 18), (45, 14, 92), (104, 24, 110), (160, 44, 98)]
_BRIGHT = [(212, 72, 66), (244, 126, 24), (249, 194, 44), (252, 252, 170)]
_ANCHORS = np.array(_DARK + _BRIGHT, dtype=np.float64)  # an even ramp from black over red to pale yellow
MISSING = 255


def palette() -> npt.NDArray[np.uint8]:
    """Return colours (255, 3) from no indentation to the deepest."""
    at = np.linspace(0, len(_ANCHORS) - 1, 255)
    ramp = [np.interp(at, np.arange(len(_ANCHORS)), _ANCHORS[:, k]) for k in range(3)]
    return np.stack(ramp, axis=1).round().astype(np.uint8)


def depth_png(depth_m: Array, deepest_m: float) -> bytes:
    """Return a PNG of one depth map; taxels without data are transparent."""
    level = np.clip(np.nan_to_num(depth_m / deepest_m, nan=0.0), 0.0, 1.0) * 254
    pixels = np.where(np.isfinite(depth_m), level.round(), MISSING).astype(np.uint8)
    image = Image.fromarray(pixels).convert("L")
    image = Image.frombytes("P", image.size, image.tobytes())
    image.putpalette([*palette().ravel().tolist(), 0, 0, 0])
    out = io.BytesIO()
    image.save(out, "PNG", transparency=MISSING, optimize=True)
    return out.getvalue()


def squeezes_section(record: RunRecord) -> str:
    """Return a row for each closure sequence and a pair of pads for each height, or nothing."""
    sets = [e.data["touchset"] for e in record.of_kind("touchset") if isinstance(e.data.get("touchset"), dict)]
    if not sets:
        return ""
    maps = [m for s in sets for layer in _layers(s) for m in _pads(layer)]
    values = np.concatenate([m[np.isfinite(m)] for m in maps]) if maps else np.zeros(0)
    deepest = max(float(np.percentile(values, 99.8)), 1e-4) if values.size else 1e-3
    ramp = palette()
    stops = ",".join(
        f"rgb({r},{g},{b}) {100 * k / 8:.0f}%" for k, (r, g, b) in enumerate(ramp[:: 254 // 8][:9].tolist())
    )
    bar = (
        f'<p class="legend">indentation 0<span class="bar" style="background:linear-gradient(90deg,{stops})"></span>'
        f"{number(deepest, 2, 'mm', 1e3)}</p>"
    )
    lead = (
        "The indentation of the two gel pads at each closure of the jaws, left and right pad side by side, upper edge "
        "towards the wrist. Each row is one sequence of closures from low to high. Captions give the height of the "
        "pads above the floor, the opening and the force. Faded closures did not come to rest and are not used."
    )
    return section("Squeezes", lead, bar + f'<div class="sets">{"".join(_set(s, deepest) for s in sets)}</div>')


def _layers(touchset: dict[str, Any]) -> list[dict[str, Any]]:
    return [layer for s in touchset.get("sequences") or [] for layer in s.get("layers") or []]


def _pads(layer: dict[str, Any]) -> list[Array]:
    """Return the left and right depth map of a recorded layer, with NaN for null."""
    out = []
    for key in ("left_m", "right_m"):
        try:
            pad = np.array(layer.get(key), dtype=np.float64)
        except (TypeError, ValueError):
            continue
        if pad.ndim == 2 and pad.size:
            out.append(pad)
    return out


def _set(touchset: dict[str, Any], deepest: float) -> str:
    candidate = touchset.get("candidate")
    index = candidate.get("index", "?") if isinstance(candidate, dict) else "?"
    layers = _layers(touchset)
    stable = sum(bool(layer.get("stable")) for layer in layers)
    rows = []
    for k, sequence in enumerate(touchset.get("sequences") or []):
        yaw = sequence.get("yaw_rad")
        turn = f"pads along {number(float(np.rad2deg(yaw)), 0)}°" if isinstance(yaw, int | float) else ""
        figures = "".join(_figure(layer, deepest) for layer in sequence.get("layers") or [])
        rows.append(
            f'<div class="seq"><p class="tag">sequence {k + 1} · {turn}</p><div class="layers">{figures}</div></div>'
        )
    title = f"<h3>Candidate {esc(index)}<small>{len(layers)} closures, {stable} at rest</small></h3>"
    return f"<div>{title}{''.join(rows) or '<p>No closure was possible.</p>'}</div>"


def _figure(layer: dict[str, Any], deepest: float) -> str:
    pads = "".join(
        f'<img alt="{side} pad" src="data:image/png;base64,{base64.b64encode(depth_png(pad, deepest)).decode()}">'
        for side, pad in zip(("left", "right"), _pads(layer), strict=False)
    )
    height, opening = number(layer.get("height_m"), 0, "mm", 1e3), number(layer.get("aperture_m"), 1, "mm", 1e3)
    return (
        f'<figure{"" if layer.get("stable") else " class=off"}><div class="pads">{pads}</div>'
        f"<figcaption>at {height}, {number(layer.get('force_N'), 1, 'N')}<br>opening <b>{opening}</b>"
        "</figcaption></figure>"
    )
