"""Noticing that an object moved between probes: contacts that no one pose explains."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.perception.touch.outline.belief import believe_outline
from glotouch_bt.perception.touch.outline.mixture import OutlineBelief
from glotouch_bt.perception.touch.values import Contact
from glotouch_bt.robot import Array

MOVED_PRIOR = 0.005
"""Probability, before looking, that an object moved between two given contacts by more than it was seen pushed."""
LIKELY_PRIOR = 0.05
"""... and between two between which much may have happened."""
FEWEST = 3
"""Contacts a pose needs to be told from another."""


def believe_contacts(
    contacts: Sequence[Contact], tip_radius_m: float, free_K_m: Array | None = None, *, outliers: int = 0
) -> OutlineBelief:
    """As `believe_outline`, from contacts in order of time; each push moves the contacts made before it."""
    return believe_outline(
        np.array([c.tip_K_m[:2] for c in contacts]),
        tip_radius_m,
        approach_K=np.array([c.approach_K[:2] for c in contacts]),
        reaction_K=np.array([c.reaction_K[:2] for c in contacts]),
        pushed_K_m=np.array([c.pushed_K_m for c in contacts]),
        free_K_m=free_K_m,
        outliers=outliers,
    )


def split_moved(
    contacts: Sequence[Contact], tip_radius_m: float, *, likely: int = 0
) -> tuple[tuple[Contact, ...], tuple[Contact, ...]]:
    """(stray, consistent): the latest contacts that one pose explains, and those from before the object moved.

    A change point by evidence: one outline explains all contacts, those before the move shifted by a common, unknown
    amount, clearly better than without a shift. With fewer than FEWEST + 1 contacts nothing is split off.

    Args:
        contacts: In order of time.
        tip_radius_m: Radius of the ball.
        likely: Before this one, if not the first, there was time for something to happen to the object.
    """
    contacts = tuple(contacts)
    scores = [believe_contacts(contacts, tip_radius_m).log_evidence]
    for first in range(1, len(contacts) - FEWEST + 1):
        moved = believe_contacts(contacts, tip_radius_m, outliers=first)
        scores.append(moved.log_evidence + math.log(LIKELY_PRIOR if first == likely else MOVED_PRIOR))
    best = int(np.argmax(scores))
    return contacts[:best], contacts[best:]
