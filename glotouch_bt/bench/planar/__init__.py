"""A fast planar simulator of exploration: probe sections of meshes, a geometric contact model, a plan executor."""

from glotouch_bt.bench.planar.assorted import assorted_world
from glotouch_bt.bench.planar.explore import Explored, Traced, explore, refine_all
from glotouch_bt.bench.planar.growth import GrowthCampaign, run_growth
from glotouch_bt.bench.planar.layout import planar_world
from glotouch_bt.bench.planar.section import FeltSection, felt_section
from glotouch_bt.bench.planar.world import ContactModel, PlanarWorld
