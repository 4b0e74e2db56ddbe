"""A matcher and a search policy as another package would bring them; see docs/guides/own_method.md."""

import numpy as np

from glotouch_bt.perception.search import Routes, SearchMap, Stretch

SD_M = 0.004


# -- matcher
def by_size(mesh, touchsets):
    """Compare length, width and height with the mesh's bounding box; return P(target) of each TouchSet."""
    x, y, z = np.ptp(mesh.vertices_m, axis=0)
    wanted = np.array([max(x, y), min(x, y), z])
    fits = []
    for t in touchsets:
        contour = t.candidate.contour
        felt = np.array([max(contour.size_m), min(contour.size_m), t.candidate.height_m])
        fits.append(np.exp(-0.5 * np.mean(((felt - wanted) / SD_M) ** 2)))
    weights = np.array(fits)
    return weights / (weights.sum() + 0.05)  # 0.05 stands for "none of them"


# -- policy
class Lawnmower:
    """Sweep the container row by row."""

    def __init__(self, seed: int) -> None:
        self.row_m = 0.045

    def next_stretch(self, belief: SearchMap, tip_K_m):
        """Return the way to the next free point of the rows that is not explored yet."""
        x, y = (np.linspace(-h, h, int(2 * h / self.row_m) + 1) for h in belief.half_extent_m)
        rows = np.concatenate([[(a, b) for b in (y if i % 2 else y[::-1])] for i, a in enumerate(x)])
        free = (belief.path_distance(rows) > 0.02) & ~belief.inside_exclusion(rows)
        for dropped in belief.dropped:
            free &= np.linalg.norm(rows - dropped, axis=1) > 0.012
        routes = Routes(belief, np.asarray(tip_K_m)[:2])
        for goal in rows[free]:
            if (way := routes.to(goal)) is not None and np.linalg.norm(way[-1] - routes.start_K_m) > 0.003:
                return Stretch(way)
        return None
