"""Shapes for the tests of outlines."""

import numpy as np

from glotouch_bt.perception.touch.outline.primitives import circle, rounded


def random_params(shape, rng):
    place, half = rng.normal(0, 0.1, 2), rng.uniform(0.010, 0.050, 2)
    if shape is circle:
        return np.array([*place, half[0]])
    return np.array([*place, rng.uniform(-3, 3), *half, *([rng.uniform(0, 0.008)] if shape is rounded else [])])


def rectangle(long, short):
    return 0.5 * np.array([[long, short], [-long, short], [-long, -short], [long, -short]])


def turned(discs, angle, shift=(0.0, 0.0)):
    c, s = np.cos(angle), np.sin(angle)
    return discs[0] @ np.array([[c, s], [-s, c]]) + shift, discs[1]
