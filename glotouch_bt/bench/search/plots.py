"""Plots of `bench search`: discovered against travel, and one layout as it was explored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from glotouch_bt.bench.planar import FeltSection
from glotouch_bt.bench.search.scoring import discovered_at
from glotouch_bt.bench.search.summary import PAPER
from glotouch_bt.bench.search.trial import SWEEP_NODE, TRACE_NODE, true_layout
from glotouch_bt.report import RunRecord, read_run
from glotouch_bt.robot import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#2567c9", "#e08a1e", "#16937a", "#8a55c7", "#c4437f", "#6b7787")
MAX_TRAVEL_M = 6.0
"""Right end of the travel axis."""


def plot_discovered(path: Path, rows: Sequence[Mapping[str, Any]], policies: Sequence[str], objects: int) -> None:
    """Draw mean discovered objects against travel, 95 % bands: MuJoCo solid, planar dashed, paper dots."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 4.6), layout="constrained")
    axes = figure.subplots()
    at = np.linspace(0.0, MAX_TRAVEL_M, 121)
    for name, colour in zip(policies, COLOURS * (1 + len(policies) // len(COLOURS)), strict=False):
        for planar, style in ((False, "-"), (True, "--")):
            mine = [r for r in rows if r["policy"] == name and (r["simulator"] == "planar") == planar]
            if mine:
                label = f"{name}, {'planar' if planar else mine[0]['simulator']} (n = {len(mine)})"
                _band(axes, at, mine, colour, style, label)
    for (name, figures), marker in zip(PAPER.items(), ("x", "+"), strict=True):
        budgets = {float(k): v for k, v in figures["mean_discovered"].items()}
        axes.plot(list(budgets), list(budgets.values()), "k" + marker, ms=8, label=f"paper, {name}")
    axes.set(xlabel="planar travel of the probe [m]", ylabel="objects discovered", xlim=(0, MAX_TRAVEL_M))
    axes.set_ylim(0, objects * 1.04)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")
    figure.savefig(path, dpi=130)


def _band(axes: Axes, at: Array, rows: Sequence[Mapping[str, Any]], colour: str, style: str, label: str) -> None:
    counts = np.array([[discovered_at(r, d) for d in at] for r in rows], dtype=np.float64)
    pick = np.random.default_rng(0).integers(0, len(rows), (400, len(rows)))
    means = np.stack([counts[p].mean(axis=0) for p in pick])
    lo, hi = np.percentile(means, [2.5, 97.5], axis=0)
    axes.plot(at, counts.mean(axis=0), style, color=colour, label=label)
    axes.fill_between(at, lo, hi, color=colour, alpha=0.15, lw=0)


def plot_layout(path: Path, run: Path, sections: Mapping[str, FeltSection]) -> None:
    """Draw true outlines, the ball's path, contacts and fitted outlines of one run."""
    record = read_run(run)
    pose_B_K, interior = record.pose_B_K, record.interior_m
    if record.truth is None or pose_B_K is None or interior is None:
        return
    layout = true_layout(record.truth, pose_B_K, dict(sections))
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 6.4), layout="constrained")
    axes = figure.subplots()
    half = 500.0 * np.array(interior[:2])
    axes.plot(half[0] * np.array([-1, 1, 1, -1, -1]), half[1] * np.array([-1, -1, 1, 1, -1]), color="#14181f", lw=1.5)
    for section, (x, y, yaw) in zip(layout.sections, layout.after, strict=True):
        c, s = np.cos(yaw), np.sin(yaw)
        outline = 1e3 * (section.outline_m @ np.array([[c, s], [-s, c]]) + (x, y))
        axes.fill(*outline.T, color="#16834a", alpha=0.25, lw=0)
        axes.annotate(section.name, (1e3 * x, 1e3 * y), ha="center", va="center", fontsize=8, color="#16834a")
    for k, piece in enumerate(_pieces(record)):
        axes.plot(*(1e3 * piece[:, :2].T), color="#8c97a6", lw=0.8, label=None if k else "ball, at sensing height")
    contours = [e.data["candidate"] for e in record.of_kind("candidate")]
    for k, candidate in enumerate(contours):
        line = 1e3 * _outline(candidate["contour"])
        axes.plot(*line.T, color="#2567c9", lw=1.2, label=None if k else "fitted outline")
        points = 1e3 * np.array([c["point_K_m"] for c in candidate["contacts"]])
        axes.plot(*points.T, ".", color="#d2452c", ms=4, label=None if k else "contacts")
    axes.set(xlabel="x in K [mm]", ylabel="y in K [mm]", aspect="equal")
    axes.set_title(f"{record.of_run('mission')}, seed {record.of_run('seed')}: truth green", fontsize=9)
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, -0.08), ncols=3)
    figure.savefig(path, dpi=130)


def _pieces(record: RunRecord) -> list[Array]:
    paths = [e.data for e in record.of_kind("sweep") if e.data.get("node") in (SWEEP_NODE, TRACE_NODE)]
    return [np.array(d["path_K_m"]).reshape(-1, len(d["path_K_m"][0])) for d in paths if d["path_K_m"]]


def _outline(contour: Mapping[str, Any]) -> Array:
    """Return the closed polyline (n, 2) of a recorded contour."""
    boundary = contour.get("boundary_K_m") or []
    if boundary:
        return np.array([*boundary, boundary[0]])
    if contour["kind"] == "round":
        a = np.linspace(0.0, 2 * np.pi, 73)
        local = 0.5 * contour["size_m"][0] * np.column_stack([np.cos(a), np.sin(a)])
    else:
        local = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * contour["size_m"]
    c, s = np.cos(contour["yaw_rad"]), np.sin(contour["yaw_rad"])
    return np.asarray(local @ np.array([[c, s], [-s, c]]) + contour["centre_K_m"])
