"""The panels of the page as HTML text. Everything that a record says is escaped: it may come from a stranger."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import numpy as np

from glotouch_bt.escaped_text import html_text as esc
from glotouch_bt.report import depth_png
from glotouch_bt.report.scene import STATE_COLOURS
from glotouch_bt.report.state import LogLine, SceneState, tree_rows
from glotouch_bt.robot import Array

INK, SOFT, IDLE, LINE = "#14181f", "#5a6472", "#98a1ad", "#dfe3e8"
TONES = {"": INK, "good": "#16834a", "warn": "#a86400", "bad": "#c5352b"}
STATUS = {"RUNNING": ("▶", "#2567c9"), "SUCCESS": ("✓", "#16834a"), "FAILURE": ("✕", "#c5352b")}
PHASES = {
    "waiting": ("waiting for the first cycle", "#5a6472"),
    "running": ("running", "#2567c9"),
    "pausing": ("pausing", "#a86400"),
    "paused": ("paused", "#a86400"),
    "ended": ("ended", "#5a6472"),
}
DEEP_M = 8e-4
"""Indentation with the brightest colour. Source: ours; a squeeze with 10 N indents the shipped gel by 0.7 mm."""
MAX_ROWS = 300
"""Lines of the tree, and candidates, that are shown."""
_BOX = f"font:12.5px/1.45 system-ui,sans-serif;color:{INK};padding:2px 12px 4px"


def status(state: SceneState, facts: Sequence[str], note: str = "", tone: str = "") -> str:
    """Return the head: phase, robot clock, the facts of the run, and a note in a colour of `TONES`."""
    words, colour = PHASES[state.phase]
    head = (
        f'<span style="font-size:22px;font-weight:650;font-variant-numeric:tabular-nums">{state.t_s:.1f} s</span> '
        f'<span style="float:right;margin-top:6px;padding:1px 10px;border-radius:99px;color:#fff;background:{colour};'
        f'font-weight:600">{words}</span>'
    )
    lines = "".join(f'<div style="color:{SOFT}">{fact}</div>' for fact in facts)
    if note:
        lines += f'<div style="color:{TONES[tone]};font-weight:600;margin-top:3px">{esc(note)}</div>'
    return f'<div style="{_BOX}"><div>{head}</div>{lines}</div>'


def fact(name: str, value: object) -> str:
    """Return one fact of the head."""
    return f'{esc(name)} <b style="color:{INK};font-weight:600">{esc(value)}</b>'


def tree(state: SceneState, *, whole: bool = False) -> str:
    """Return the behavior tree: what runs unfolded, the rest folded."""
    out = []
    for row in tree_rows(state.nodes, whole=whole)[:MAX_ROWS]:
        sign, colour = STATUS.get(row.status, ("·", IDLE))
        weight = 600 if row.status == "RUNNING" else 400
        ink = {"": IDLE, "FAILURE": colour, "RUNNING": INK}.get(row.status, SOFT)
        more = f' <span style="color:{IDLE}">+{row.folded}</span>' if row.folded else ""
        out.append(
            f'<div title="{esc(row.path)}" style="display:flex;padding-left:{10 * row.depth}px;color:{ink};'
            f'font-weight:{weight};line-height:1.35"><span style="color:{colour};flex:0 0 16px">{sign}</span>'
            f"<span>{esc(row.label)}{more}</span></div>"
        )
    return f'<div style="{_BOX}">{"".join(out) or _nothing("no node has run yet")}</div>'


def posterior(state: SceneState, target: str) -> str:
    """Return one bar for each candidate, and one for none of them; their sizes while nothing was compared."""
    rows = []
    shares = {s.index: s.probability for s in state.shares}
    sizes = {o.index: (*o.size_m, o.height_m) for o in state.outlines}
    known = sorted({o.index for o in state.outlines} | {i for i in shares if i is not None})[:MAX_ROWS]
    for index in known:
        word = state.states.get(index, "found")
        colour = "rgb({},{},{})".format(*STATE_COLOURS[word])
        if shares:
            rows.append(_bar(f"candidate {index}", shares.get(index), colour, "" if word == "found" else word))
        else:
            rows.append(_size(f"candidate {index}", colour, sizes[index]))
    if None in shares:
        rows.append(_bar("none of them", shares[None], IDLE, ""))
    if not rows:
        return f'<div style="{_BOX}">{_nothing("no candidate found yet")}</div>'
    title = f'<div style="color:{SOFT};margin-bottom:3px">Which one is <b style="color:{INK}">{esc(target)}</b>?</div>'
    return f'<div style="{_BOX}">{title if shares else ""}{"".join(rows)}</div>'


def _bar(name: str, share: float | None, colour: str, word: str) -> str:
    width = 100.0 * min(max(share or 0.0, 0.0), 1.0)
    number = "–" if share is None else f"{100 * share:.1f} %"
    return (
        '<div style="display:flex;align-items:center;gap:8px;height:19px;font-variant-numeric:tabular-nums">'
        f'<span style="width:94px;color:{colour};font-weight:600;white-space:nowrap">{esc(name)}</span>'
        f'<span style="flex:1;height:10px;background:#eef1f4;border-radius:5px"><span style="display:block;height:10px;'
        f'width:{width:.1f}%;background:{colour};border-radius:5px"></span></span>'
        f'<span style="width:46px;text-align:right">{number}</span>'
        f'<span style="width:50px;color:{SOFT}">{esc(word)}</span></div>'
    )


def _size(name: str, colour: str, size_m: tuple[float, float, float]) -> str:
    words = " × ".join(f"{1e3 * m:.0f}" for m in size_m)
    return (
        '<div style="display:flex;gap:8px;height:19px;font-variant-numeric:tabular-nums">'
        f'<span style="width:94px;color:{colour};font-weight:600">{esc(name)}</span><span>{words} mm</span></div>'
    )


def gels(state: SceneState) -> str:
    """Return both depth maps side by side, on one colour scale, and the jaws' report."""
    jaws = f"opening {1e3 * state.aperture_m:.1f} mm · jaw force {state.jaw_force_N:.1f} N"
    if state.pads is None:
        return f'<div style="{_BOX};color:{SOFT}">{_nothing("no image")} · {jaws}</div>'
    sides = [_gel(name, pad) for name, pad in zip(("left", "right"), state.pads, strict=True)]
    return (
        f'<div style="{_BOX}"><div style="display:flex;gap:14px;justify-content:center">{"".join(sides)}</div>'
        f'<div style="color:{SOFT};text-align:center">{jaws}</div></div>'
    )


def _gel(name: str, depth_m: Array) -> str:
    frame = f"width:84px;height:147px;border-radius:5px;background:#14101f;border:1px solid {LINE}"
    data = base64.b64encode(depth_png(depth_m, DEEP_M)).decode()
    deepest = 1e3 * float(np.nanmax(depth_m)) if np.isfinite(depth_m).any() else 0.0
    picture = f'<img alt="{name} gel" style="{frame};image-rendering:pixelated" src="data:image/png;base64,{data}">'
    return f'<div style="text-align:center">{picture}<div style="color:{SOFT}">{name}, {deepest:.2f} mm</div></div>'


def log(lines: Sequence[LogLine], limit: int = 60) -> str:
    """Return the newest events, newest first."""
    rows = "".join(
        f'<div style="display:flex;gap:8px;padding:1px 0;color:{TONES[line.tone]}">'
        f'<span style="width:42px;text-align:right;color:{SOFT};font-variant-numeric:tabular-nums">{line.stamp_s:.1f}'
        f'</span><span style="width:76px;font-weight:600;overflow:hidden;text-overflow:ellipsis">{esc(line.kind)}'
        f'</span><span style="flex:1">{esc(line.text)}</span></div>'
        for line in reversed(lines[-limit:])
    )
    return f'<div style="{_BOX};font-size:12px">{rows or _nothing("no event yet")}</div>'


def _nothing(words: str) -> str:
    return f'<span style="color:{IDLE}">{esc(words)}</span>'
