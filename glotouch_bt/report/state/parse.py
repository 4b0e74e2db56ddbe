"""Recorded events as values of the scene. One of another shape gives nothing, no error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from glotouch_bt.mission.record import event_tone, event_words
from glotouch_bt.perception.touch import Contour
from glotouch_bt.report.contours import contour_of
from glotouch_bt.report.run_record import RecordedEvent
from glotouch_bt.report.state.values import (
    CandidateOutline,
    FeltPatch,
    FittedTarget,
    GhostObject,
    LogLine,
    PlannedGrasp,
    Share,
    TouchPoint,
)
from glotouch_bt.robot import Array, Pose
from glotouch_bt.robot.scene import UPRIGHT

MALFORMED = (AttributeError, IndexError, KeyError, TypeError, ValueError)
"""Errors of data of another shape."""
MIN_FELT_M = 5e-5
"""Smallest indentation that is drawn as felt. Source: ours, three times the noise of a taxel."""
EDGE_M = 0.004
"""Longest edge of a drawn outline: along a side of a rectangle, the uncertainty is that of the side. Source: ours."""
MAX_DIVISIONS = 100
"""Most parts of one edge."""


def vector(value: Any, n: int) -> Array:
    """Return `n` finite numbers as an array.

    Raises:
        ValueError, TypeError: They are not.
    """
    a = np.asarray(value, dtype=np.float64)
    if a.shape != (n,) or not np.isfinite(a).all():
        raise ValueError(f"not {n} numbers")
    return a


def touch_of(event: RecordedEvent) -> TouchPoint | None:
    """Return the touch of a contact event."""
    try:
        c = event.data["contact"]
        tip, point = vector(c["tip_K_m"], 3), vector(c["point_K_m"], 2)
        outward = vector(c.get("reaction_K") or (0.0, 0.0, 0.0), 3)
        return TouchPoint(float(c["stamp_s"]), np.array([*point, tip[2]]), outward, float(c.get("force_N") or 0.0))
    except MALFORMED:
        return None


def outline_of(event: RecordedEvent) -> CandidateOutline | None:
    """Return the outline of a candidate or touchset event."""
    try:
        holder = event.data["touchset"] if event.kind == "touchset" else event.data
        candidate = holder["candidate"]
        contour = contour_of(candidate)
        if contour is None:
            return None
        outline = densified(contour.outline_K_m(64), EDGE_M)
        normal = outward_normals(outline)
        sd = outline_sd_m(contour, outline, normal, candidate["contour"].get("covariance"))
        height = float(candidate["height_m"])
        if not (np.isfinite(outline).all() and math.isfinite(height)):
            return None
        long, short = map(float, contour.size_m)
        return CandidateOutline(
            int(candidate["index"]), outline, normal, sd, (long, short), height, str(contour.family)
        )
    except MALFORMED:
        return None


def densified(outline_m: Array, edge_m: float) -> Array:
    """Return a closed polyline (n, 2) with its edges divided, so that none is longer than `edge_m`."""
    lengths = np.linalg.norm(np.diff(outline_m, axis=0), axis=1)
    counts = np.clip(np.ceil(lengths / edge_m), 1, MAX_DIVISIONS).astype(int)
    parts = [
        a + np.arange(n)[:, None] / n * (b - a)
        for a, b, n in zip(outline_m[:-1], outline_m[1:], counts.tolist(), strict=True)
    ]
    return np.concatenate([*parts, outline_m[-1:]])


def outward_normals(outline_m: Array) -> Array:
    """Return the outward unit normal (n, 2) at each corner of a closed polyline (n, 2): the mean of its two edges."""
    edges = np.diff(outline_m, axis=0)
    edges /= np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-12)
    along = edges + np.roll(edges, 1, axis=0)
    along = np.concatenate([along, along[:1]])
    x, y = outline_m.T
    anticlockwise = np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) >= 0.0
    normal = np.column_stack([along[:, 1], -along[:, 0]]) * (1.0 if anticlockwise else -1.0)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12))


def outline_sd_m(contour: Contour, outline_K_m: Array, normal: Array, covariance: Any) -> Array:
    """Return the standard deviation (n,) of each corner of an outline along its normal, to first order.

    The gradient g of the normal displacement by the parameters is (normal, 1) for a circle, (normal, lever, end, side)
    for a rectangle and the normal for a free outline; the variance is g C g. Source: `Contour.covariance`.
    """
    try:
        c = np.asarray(covariance, dtype=np.float64)
        k = {"circle": 3, "rectangle": 5}.get(str(contour.family), 2)
        if c.shape != (k, k) or not np.isfinite(c).all():
            return np.zeros(len(outline_K_m))
    except (TypeError, ValueError):
        return np.zeros(len(outline_K_m))
    radial = outline_K_m - contour.centre_K_m
    if k == 3:
        gradient = np.column_stack([normal, np.ones(len(normal))])
    elif k == 5:
        a = contour.yaw_rad
        long, short = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
        lever = normal[:, 1] * radial[:, 0] - normal[:, 0] * radial[:, 1]
        gradient = np.column_stack([normal, lever, np.abs(normal @ long), np.abs(normal @ short)])
    else:
        gradient = normal
    return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", gradient, c, gradient), 0.0)))


def grasp_of(event: RecordedEvent) -> PlannedGrasp | None:
    """Return the grasp of a plan event."""
    try:
        p = event.data["plan"]
        numbers = vector([p["yaw_rad"], p["opening_m"], p["aperture_m"]], 3).tolist()
        return PlannedGrasp(int(p["candidate"]), vector(p["position_K_m"], 3), *numbers)
    except MALFORMED:
        return None


def fit_of(event: RecordedEvent) -> FittedTarget | None:
    """Return the accepted target of a ranking event."""
    try:
        ranking = event.data["ranking"]
        if not ranking["accepted"]:
            return None
        best = ranking["matches"][0]
        x, y, yaw = vector(best["pose_K_O"], 3).tolist()
        w, *axis = vector(best.get("quat") or UPRIGHT, 4).tolist()
        return FittedTarget(int(best["index"]), str(event.data["target"]), (x, y, yaw), (w, *axis))
    except MALFORMED:
        return None


def patches_of(event: RecordedEvent, window_m: tuple[float, float]) -> list[FeltPatch]:
    """Return the patches of every closure of a touchset event that came to rest.

    Args:
        event: The event.
        window_m: Size of a pad along x_P and along z_P.
    """
    try:
        return [
            _patch(layer, float(layer.get("yaw_rad", sequence.get("yaw_rad"))), window_m)
            for sequence in event.data["touchset"].get("sequences") or ()
            for layer in sequence.get("layers") or ()
            if layer.get("stable")
        ]
    except MALFORMED:
        return []


def _patch(layer: dict[str, Any], yaw_rad: float, window_m: tuple[float, float]) -> FeltPatch:
    x, y = vector(layer["position_K_m"], 2)
    centre = np.array([x, y, float(layer["height_m"])])
    both = [np.array(layer[side], dtype=np.float64) for side in ("left_m", "right_m")]
    points_P, depth_m = felt_points_P(both[0], both[1], float(layer["aperture_m"]), window_m)
    return FeltPatch(Pose.pointing_down(centre, yaw_rad).apply(points_P), depth_m)


def felt_points_P(
    left_m: Array, right_m: Array, aperture_m: float, window_m: tuple[float, float]
) -> tuple[Array, Array]:
    """Return the points (n, 3) in P where the gels are indented, and the indentation (n,).

    Args:
        left_m, right_m: Depth maps (rows, cols): rows along +z_P, columns along +x_P, the left pad at +y_P.
        aperture_m: Distance between the undeformed surfaces.
        window_m: Size of a pad along x_P and along z_P.
    """
    points, depths = [], []
    for depth, side in ((left_m, 1.0), (right_m, -1.0)):
        rows, cols = depth.shape
        z = ((np.arange(rows) + 0.5) / rows - 0.5) * window_m[1]
        x = ((np.arange(cols) + 0.5) / cols - 0.5) * window_m[0]
        r, c = np.nonzero(np.nan_to_num(depth) > MIN_FELT_M)
        felt = depth[r, c]
        points.append(np.column_stack([x[c], side * (0.5 * aperture_m + felt), z[r]]))
        depths.append(felt)
    return np.concatenate(points), np.concatenate(depths)


def shares_of(event: RecordedEvent) -> tuple[Share, ...]:
    """Return the posterior of a next_probe, closure, decided or ranking event, most probable first."""
    try:
        ranking = event.data.get("ranking")
        if isinstance(ranking, dict):
            found = {m["index"]: m["probability"] for m in ranking.get("matches") or ()}
            absent = ranking.get("p_absent")
        else:
            found, absent = dict(event.data["probability"]), event.data.get("p_absent")
        shares = [Share(int(i), float(p)) for i, p in found.items()]
        if isinstance(absent, int | float):
            shares.append(Share(None, float(absent)))
    except MALFORMED:
        return ()
    return tuple(sorted((s for s in shares if math.isfinite(s.probability)), key=lambda s: -s.probability))


def true_bodies(listed: Any) -> Iterator[GhostObject]:
    """Yield the objects of one list of truth.json."""
    for o in listed if isinstance(listed, list) else ():
        try:
            outline = np.asarray(o["outline_B_m"], dtype=np.float64)[:, :2]
            pose = o["pose_B_O"]
            size = o.get("size_m")
            yield GhostObject(
                str(o["name"]), vector(pose["position_m"], 3), vector(pose["quat"], 4), outline,
                None if size is None else vector(size, 3),
            )  # fmt: skip
        except MALFORMED:
            continue


def log_line(event: RecordedEvent) -> LogLine:
    """Return an event in words."""
    return LogLine(event.stamp_s, event.kind, event_words(event.kind, event.data), event_tone(event.kind))
