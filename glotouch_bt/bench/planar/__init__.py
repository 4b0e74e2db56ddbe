"""A fast planar simulator of exploration: probe sections of meshes, a geometric contact model, a plan executor."""

from glotouch_bt.bench.planar.drive import drive
from glotouch_bt.bench.planar.explore import BUDGET_M, Traced, explore, refine_all
from glotouch_bt.bench.planar.layout import planar_world
from glotouch_bt.bench.planar.section import SENSING_HEIGHT_M, FeltSection, felt_section
from glotouch_bt.bench.planar.world import WALL, ContactModel, Logged, PlanarWorld

__all__ = [
    "BUDGET_M",
    "SENSING_HEIGHT_M",
    "WALL",
    "ContactModel",
    "FeltSection",
    "Logged",
    "PlanarWorld",
    "Traced",
    "drive",
    "explore",
    "felt_section",
    "planar_world",
    "refine_all",
]
