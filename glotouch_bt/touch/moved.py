"""Noticing that an object moved between probes: contacts that no one pose explains (issue: re-tracing)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.touch.belief import OutlineBelief, believe_outline
from glotouch_bt.touch.values import Contact

STRAY_M = 0.04
"""A contact that belongs to another pose may lie anywhere in a band so wide about this one's outline."""
MOVED_PRIOR = 0.02
"""Probability, before looking, that an object moved between two given contacts by more than it was seen pushed."""
FEWEST = 3
"""Contacts a pose needs to be told from another."""


def believe_contacts(contacts: Sequence[Contact], tip_radius_m: float, free_K_m: Array | None = None) -> OutlineBelief:
    """As `believe_outline`, from contacts in order of time; each push moves the contacts made before it."""
    return believe_outline(
        np.array([c.tip_K_m[:2] for c in contacts]),
        tip_radius_m,
        approach_K=np.array([c.approach_K[:2] for c in contacts]),
        reaction_K=np.array([c.reaction_K[:2] for c in contacts]),
        pushed_K_m=np.array([c.pushed_K_m for c in contacts]),
        free_K_m=free_K_m,
    )


def split_moved(contacts: Sequence[Contact], tip_radius_m: float) -> tuple[tuple[Contact, ...], tuple[Contact, ...]]:
    """(stray, consistent): the latest contacts that one pose explains, and those from before the object moved.

    A change point by evidence: the contacts since the move have one outline, each one before it lies anywhere within
    STRAY_M. With fewer than 4 contacts nothing is split off.
    """
    contacts = tuple(contacts)
    if len(contacts) <= FEWEST:
        return (), contacts
    # Log density of a stray contact on the scale of `log_evidence`, which leaves out a factor sqrt(2 pi) a contact.
    stray = 0.5 * math.log(2 * math.pi) - math.log(STRAY_M)
    scores = []
    for first in range(len(contacts) - FEWEST + 1):
        score = believe_contacts(contacts[first:], tip_radius_m).log_evidence + first * stray
        scores.append(score + (math.log(MOVED_PRIOR) if first else 0.0))
    best = int(np.argmax(scores))
    return contacts[:best], contacts[best:]
