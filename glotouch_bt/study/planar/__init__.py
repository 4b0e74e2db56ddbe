"""A fast planar stand-in for the physics: felt sections, a geometric contact model, and a driver of plans."""

from glotouch_bt.study.planar.drive import drive
from glotouch_bt.study.planar.layout import planar_world
from glotouch_bt.study.planar.section import SENSING_HEIGHT_M, FeltSection, felt_section
from glotouch_bt.study.planar.world import WALL, ContactModel, Logged, PlanarWorld

__all__ = [
    "SENSING_HEIGHT_M",
    "WALL",
    "ContactModel",
    "FeltSection",
    "Logged",
    "PlanarWorld",
    "drive",
    "felt_section",
    "planar_world",
]
