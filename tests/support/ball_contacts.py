"""Contacts of a ball with discs and boxes, by formula, and the candidates that they give."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.search import outline_of, quality
from glotouch_bt.perception.touch import Candidate, Contact

R = 0.006
NO_PATH = np.zeros((0, 2))


def contact(x: float, y: float, angle: float) -> Contact:
    """A ball's contact with a surface through (x, y) whose outward normal has this angle."""
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    tip = np.array([x, y, 0.018]) + R * out
    return Contact(0.0, tip, -out, out, tip[:2] - R * out[:2], 1.0)


def disc(x: float, y: float, radius: float, degrees: tuple[float, ...]) -> tuple[Contact, ...]:
    return tuple(contact(x + radius * np.cos(a), y + radius * np.sin(a), a) for a in np.deg2rad(degrees))


def box(x: float, length: float, width: float) -> tuple[Contact, ...]:
    """Nine contacts round a box: three on each long side, two on the end on the left and one on the right."""
    along = [(x + t * length, side * 0.5 * width, side * np.pi / 2) for side in (1, -1) for t in (-0.35, 0.0, 0.35)]
    ends = [(x - 0.5 * length, 0.3 * width, np.pi), (x - 0.5 * length, -0.3 * width, np.pi), (x + 0.5 * length, 0, 0)]
    return tuple(contact(*c) for c in (*along, *ends))


def candidate(index: int, contacts: tuple[Contact, ...]) -> Candidate:
    outline = outline_of(contacts, R)
    return Candidate(index, outline.contour, 0.018, quality(outline), contacts)
