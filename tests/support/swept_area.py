"""How much of a container a search has covered."""

import numpy as np

from glotouch_bt.perception.search import SearchMap


def covered_fraction(belief: SearchMap, coverage_radius_m: float) -> float:
    """Return the fraction of the permitted region that is near the path or inside an envelope, on a 5 mm grid."""
    axes = [np.linspace(-h, h, max(int(2 * h / 0.005) + 1, 2)) for h in belief.half_extent_m]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    covered = (belief.path_distance(grid) <= coverage_radius_m) | belief.inside_exclusion(grid)
    return float(np.mean(covered))
