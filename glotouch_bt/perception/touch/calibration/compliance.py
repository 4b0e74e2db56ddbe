"""Compliance of the held probe: displacement of its ball against the hand per force on the ball.

The pads' gel carries the handle. It yields most in rotation about the jaws' axis, which displaces the ball along x_P,
and less across, along y_P; these are the principal axes. A wall that is pressed harder stays where it is, so that the
hand's advance between two rests is the ball's deflection:

    n . diag(c) n  f = s

for the unit direction n of the press in P, the increase f of the opposing force and the advance s. The wall counts as
rigid: what it gives is counted as the probe's.

A gain error g of the wrist makes the measured compliance c / g and a later force g f. Their product, the correction, is
exact; the gain itself is not observable from touches of a wall, whose stiffness is not known independently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, ParamError

UNMEASURED_M_N = 2e-4
"""Compliance along either axis of a tool that was not pressed. Source: fingers and grasp, simulated in `nominal`."""


@dataclass(frozen=True)
class Press:
    """One press of a wall, between two rests of the hand.

    Attributes:
        direction_P: (2,) unit direction of the press in P's x and y.
        advance_m: Advance of the hand along it.
        force_N: Increase of the force that opposes it.
    """

    direction_P: Array
    advance_m: float
    force_N: float


def solve_compliance(presses: Sequence[Press]) -> Array:
    """Return the compliance (2,) m/N along x_P and y_P by least squares over the presses; negative ones count as zero.

    Raises:
        ParamError: A press without an increase of the force, or presses that do not determine both axes.
    """
    weak = [p.force_N for p in presses if not p.force_N > 0.0]
    if weak:
        raise ParamError("presses.force_N", weak, "positive")
    rows = np.array([np.square(p.direction_P) for p in presses]).reshape(-1, 2)
    if np.linalg.matrix_rank(rows, tol=0.1) < 2:
        raise ParamError("presses.direction_P", rows.tolist(), "two directions between which the axes differ")
    found, *_ = np.linalg.lstsq(rows, np.array([p.advance_m / p.force_N for p in presses]), rcond=None)
    return np.asarray(np.maximum(found, 0.0))
