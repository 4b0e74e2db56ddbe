"""The fitted contour of a recorded candidate."""

from __future__ import annotations

from typing import Any

import numpy as np

from glotouch_bt.perception.touch import Contour
from glotouch_bt.robot import Array


def contour_of(candidate: dict[str, Any]) -> Contour | None:
    """Return the contour of a recorded candidate, or None if it is invalid."""
    c: Any = candidate.get("contour")
    try:
        return Contour(
            kind=c["kind"],
            centre_K_m=np.asarray(c["centre_K_m"], float),
            size_m=(float(c["size_m"][0]), float(c["size_m"][1])),
            yaw_rad=float(c["yaw_rad"]),
            rms_m=float(c["rms_m"] or 0.0),
            residuals_m=np.asarray(c.get("residuals_m") or [], float),
            family=c.get("family"),
            boundary_K_m=_corners(c) if c.get("family") == "free" else np.zeros((0, 2)),
        )
    except (KeyError, TypeError, ValueError, IndexError):
        return None


def _corners(contour: dict[str, Any]) -> Array:
    """Return the corners (n, 2) of a recorded free outline; raise ValueError if they are invalid."""
    corners = np.asarray(contour["boundary_K_m"], float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.isfinite(corners).all():
        raise ValueError("not the corners of an outline")
    return corners
