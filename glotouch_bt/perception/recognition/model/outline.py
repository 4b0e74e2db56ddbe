"""Simulated tracing of a solid: its outline as a circle or a rectangle, and its standard deviation.

The solid is traced many times with the probe's geometry, and each trace is fitted by the same code as real contacts. So
systematic errors of the fit (e.g. a leg fitted as a side) are part of the prediction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import scipy

from glotouch_bt.perception.touch import Contour, ContourKind, fit_contour, fit_kind
from glotouch_bt.robot import Array, ParamError

if TYPE_CHECKING:
    import trimesh

TIP_RADIUS_M = 0.006
"""Radius of the probe's ball. Source: `robot.Probe`."""
SHAFT_RADIUS_M = 0.004
"""Radius of the probe's shaft. Source: `robot.Probe`."""
SHAFT_M = 0.100
"""Length of the lower part of the shaft. Source: ours; a whole `robot.Probe` is 120 mm long."""
SENSING_M = 0.018
"""Height of the ball's centre during a trace."""
TRACES = 10
"""Number of simulated traces."""
CONTACTS = 10
"""Number of contacts per trace."""
CONTACT_SD_M = 5e-4
"""Standard deviation of a simulated contact."""
MIDDLE_SD_M = 3e-3
"""Standard deviation of the point that the probe aims at."""


@dataclass(frozen=True)
class KindFit:
    """Traces fitted as one kind: averages and standard deviations over traces.

    Attributes:
        centre_m, centre_sd_m: (2,) centre in the frame of the solid; standard deviation per coordinate.
        size_m, size_sd_m: (long, short), and the standard deviation of each.
        fit_sd_m: Largest standard deviation that a fit states for each size, knowing nothing of the solid.
        contacts: Median number of contacts of a trace; approaches that miss the solid give none.
        yaw_rad, yaw_sd_rad: Direction of the long side (mod pi) and its standard deviation; 0 and pi for a circle.
    """

    centre_m: Array
    centre_sd_m: float
    size_m: tuple[float, float]
    size_sd_m: tuple[float, float]
    fit_sd_m: tuple[float, float]
    contacts: int
    yaw_rad: float
    yaw_sd_rad: float


@dataclass(frozen=True)
class Outline:
    """Outline of a model, as each kind.

    Attributes:
        as_round, as_box: Traces fitted as that kind (only those classified so, if at least three).
        p_box: Probability that a trace is classified as a box, by Laplace's rule.
    """

    as_round: KindFit
    as_box: KindFit
    p_box: float

    def of(self, kind: ContourKind) -> KindFit:
        """Return the fit as `kind`."""
        return self.as_box if kind == "box" else self.as_round

    @property
    def likely(self) -> KindFit:
        """The fit as the more probable kind."""
        return self.as_box if self.p_box > 0.5 else self.as_round


Tips = Callable[[Array, int, float], Array]
"""Ball centres (k, 2) of radial approaches to a point (2,): a number of contacts, the first from a bearing in rad."""


def traced_outline(solid: trimesh.Trimesh, traces: int = TRACES) -> Outline:
    """Trace `solid` (z up, standing on z = 0) `traces` times and fit; deterministic.

    Raises:
        ParamError: Fewer than 3 contacts are possible: the solid is lower than the probe's ball.
    """
    middle = minimum_rectangle(np.asarray(solid.vertices)[:, :2])[3]
    return outline_of(partial(traced_tips, solid), middle, traces)


def outline_of(tips_at: Tips, middle_m: Array, traces: int = TRACES) -> Outline:
    """Fit `traces` simulated traces about a point (2,); deterministic.

    Raises:
        ParamError: Fewer than 3 contacts are possible.
    """
    rng = np.random.default_rng(0)
    chosen: list[Contour] = []
    rounds: list[Contour] = []
    boxes: list[Contour] = []
    for i in range(traces):
        aim = middle_m + rng.normal(0, MIDDLE_SD_M, 2)
        tips = tips_at(aim, CONTACTS, i * math.radians(360 * 0.618) / CONTACTS)
        if len(tips) < 3:
            raise ParamError("solid", f"{len(tips)} contacts", "high enough to be traced: at least 12 mm")
        tips = tips + rng.normal(0, CONTACT_SD_M, tips.shape)
        chosen.append(fit_contour(tips, TIP_RADIUS_M))
        rounds.append(chosen[-1] if chosen[-1].kind == "round" else fit_kind(tips, TIP_RADIUS_M, "round"))
        boxes.append(chosen[-1] if chosen[-1].kind == "box" else fit_kind(tips, TIP_RADIUS_M, "box"))
    called_box = [c for c in chosen if c.kind == "box"]
    called_round = [c for c in chosen if c.kind == "round"]
    return Outline(
        _summary(called_round if len(called_round) > 2 else rounds),
        _summary(called_box if len(called_box) > 2 else boxes),
        (len(called_box) + 1) / (traces + 2),
    )


def _summary(fits: list[Contour]) -> KindFit:
    centre = np.array([f.centre_K_m for f in fits])
    size = np.array([f.size_m for f in fits])
    yaw, yaw_sd = 0.0, math.pi
    if fits[0].kind == "box":
        mean = np.mean(np.exp(2j * np.array([f.yaw_rad for f in fits])))
        yaw = 0.5 * float(np.angle(mean))
        yaw_sd = 0.5 * math.sqrt(-2 * math.log(min(max(float(abs(mean)), 1e-6), 1 - 1e-9)))
    (long, short), (long_sd, short_sd) = np.median(size, axis=0).tolist(), size.std(axis=0).tolist()
    stated = [max(math.sqrt(size_variance_m2(f, side)) for f in fits) for side in (0, 1)]
    contacts = int(np.median([len(f.residuals_m) for f in fits]))
    centre_sd = float(np.sqrt(centre.var(axis=0).mean()))
    return KindFit(
        np.median(centre, axis=0), centre_sd, (long, short), (long_sd, short_sd), (stated[0], stated[1]), contacts, yaw,
        yaw_sd,
    )  # fmt: skip


def size_variance_m2(contour: Contour, side: int) -> float:
    """Return the variance of a whole side from the fit's covariance of the half; 0 if unknown.

    A free outline has a covariance of its centre only; half a side is at most as uncertain as that.
    """
    covariance = contour.covariance
    if contour.family == "free" and covariance.shape == (2, 2) and np.isfinite(covariance).all():
        return 4.0 * float(np.linalg.eigvalsh(covariance)[-1])
    at = {"circle": 2, "rectangle": 3 + side}.get(contour.family or "", len(covariance))
    variance = 4.0 * float(covariance[at, at]) if at < len(covariance) else 0.0
    return variance if math.isfinite(variance) else 0.0


def traced_tips(solid: trimesh.Trimesh, aim_m: Array, contacts: int, start_rad: float) -> Array:
    """Return ball centres (k, 2) at the first contact of radial approaches to `aim_m` from evenly spaced bearings.

    The ball (or the shaft above it, at an overhang) stops where the first of a bundle of rays meets the surface.
    """
    a, b = np.meshgrid(np.linspace(-0.9, 0.9, 7), np.linspace(-0.9, 0.9, 7))
    disc = np.column_stack([a.ravel(), b.ravel()])
    disc = disc[(disc**2).sum(axis=1) < 0.95] * TIP_RADIUS_M
    nose = np.sqrt(TIP_RADIUS_M**2 - (disc**2).sum(axis=1))
    sa, sb = np.meshgrid(np.array([-0.9, 0.0, 0.9]) * SHAFT_RADIUS_M, np.arange(0.004, SHAFT_M, 0.004))
    bundle = np.concatenate([disc, np.column_stack([sa.ravel(), sb.ravel()])])
    nose = np.concatenate([nose, np.sqrt(SHAFT_RADIUS_M**2 - sa.ravel() ** 2)])
    angle = start_rad + np.linspace(0, 2 * np.pi, contacts, endpoint=False)
    u = np.column_stack([np.cos(angle), np.sin(angle)])
    side = np.column_stack([-u[:, 1], u[:, 0]])
    far = float(np.abs(solid.vertices[:, :2]).max()) * 3 + 0.02
    o = np.zeros((contacts, len(bundle), 3))
    o[..., :2] = aim_m + far * u[:, None, :] + bundle[None, :, :1] * side[:, None, :]
    o[..., 2] = SENSING_M + bundle[:, 1]
    d = np.zeros_like(o)
    d[..., :2] = -u[:, None, :]
    t = first_hit(solid, o.reshape(-1, 3), d.reshape(-1, 3)).reshape(contacts, len(bundle))
    stop = (far - t + nose).max(axis=1)
    met = np.isfinite(stop) & (stop > 0)
    return np.asarray(aim_m + stop[met, None] * u[met])


def first_hit(solid: trimesh.Trimesh, origins_m: Array, directions: Array) -> Array:
    """Return the distance (n,) along each ray (n, 3) to the solid's first surface; inf without a hit."""
    hit = solid.ray.intersects_first(origins_m, directions)
    n, p = solid.face_normals[hit], solid.triangles[hit, 0]
    along = np.einsum("ij,ij->i", n, directions)
    t = np.einsum("ij,ij->i", n, p - origins_m) / np.where(np.abs(along) < 1e-9, np.nan, along)
    return np.where((hit >= 0) & np.isfinite(t), t, np.inf)


def minimum_rectangle(points_m: Array) -> tuple[float, float, float, Array]:
    """Return (long, short, yaw of the long side, centre (2,)) of the minimum-area rectangle of points (k, 2)."""
    hull = points_m[scipy.spatial.ConvexHull(points_m).vertices]
    edges = np.roll(hull, -1, axis=0) - hull
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    u, v = c * hull[:, 0] + s * hull[:, 1], -s * hull[:, 0] + c * hull[:, 1]
    du, dv = np.ptp(u, axis=1), np.ptp(v, axis=1)
    i = int(np.argmin(du * dv))
    mu, mv = 0.5 * (u[i].max() + u[i].min()), 0.5 * (v[i].max() + v[i].min())
    yaw = float(angles[i])
    centre = np.array([math.cos(yaw) * mu - math.sin(yaw) * mv, math.sin(yaw) * mu + math.cos(yaw) * mv])
    if dv[i] > du[i]:
        return float(dv[i]), float(du[i]), yaw + math.pi / 2, centre
    return float(du[i]), float(dv[i]), yaw, centre
