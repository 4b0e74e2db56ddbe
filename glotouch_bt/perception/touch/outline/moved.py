"""Change-point detection: did the object move between two contacts?"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.perception.touch.outline.belief import infer_outline
from glotouch_bt.perception.touch.outline.mixture import OutlineBelief
from glotouch_bt.perception.touch.values import Contact

MOVED_PRIOR = 0.005
"""Prior probability of an unobserved motion between two given contacts."""
LIKELY_PRIOR = 0.05
"""Prior probability of an unobserved motion between two contacts far apart in time."""
MIN_CONTACTS = 3
"""Minimum number of contacts after a motion."""
MAX_FREE = 0.95
"""Largest probability of the free family for the larger part of the contacts at which a motion is believed. Contacts
with an irregular outline fit a motion as well as their own shape. Source: 269 recorded outlines (simulation, nominal).
In 28 of them a motion of 2 to 21 mm was inferred, 27 times of an irregular object; the eight of these that no jaw
touched had moved by 0.2 to 3.3 mm in the whole mission."""


def infer_outline_from_contacts(
    contacts: Sequence[Contact], tip_radius_m: float, *, outliers: int = 0
) -> OutlineBelief:
    """Infer the outline from contacts in order of time, with the displacement of the object by each contact."""
    return infer_outline(
        np.array([c.tip_K_m[:2] for c in contacts]),
        tip_radius_m,
        approach_K=np.array([c.approach_K[:2] for c in contacts]),
        reaction_K=np.array([c.reaction_K[:2] for c in contacts]),
        pushed_K_m=np.array([c.pushed_K_m for c in contacts]),
        outliers=outliers,
    )


def split_at_motion(
    contacts: Sequence[Contact], tip_radius_m: float, *, likely: int = 0
) -> tuple[tuple[Contact, ...], tuple[Contact, ...]]:
    """Split contacts into (those before the object's last motion, those after it), by evidence.

    Under a motion, the earlier contacts are shifted by a common, unknown amount. It is believed of circles and
    rectangles only (`MAX_FREE`). With fewer than MIN_CONTACTS + 1 contacts the first part is empty.

    Args:
        contacts: In order of time.
        tip_radius_m: Radius of the ball.
        likely: Index of the first contact after a long pause; 0 if there was none.
    """
    contacts = tuple(contacts)
    scores = [infer_outline_from_contacts(contacts, tip_radius_m).log_evidence]
    for first in range(1, len(contacts) - MIN_CONTACTS + 1):
        moved = infer_outline_from_contacts(contacts, tip_radius_m, outliers=first)
        scores.append(moved.log_evidence + math.log(LIKELY_PRIOR if first == likely else MOVED_PRIOR))
    best = int(np.argmax(scores))
    larger = contacts[:best] if 2 * best > len(contacts) else contacts[best:]
    if best and infer_outline_from_contacts(larger, tip_radius_m).family_weights["free"] > MAX_FREE:
        best = 0
    return contacts[:best], contacts[best:]
