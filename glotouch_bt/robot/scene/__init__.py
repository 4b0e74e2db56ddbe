"""The nominal world, its objects (STL files) and random layouts, and the disturbances of a trial. Values only."""

from glotouch_bt.robot.scene.conditions import AXES, Conditions
from glotouch_bt.robot.scene.meshes import (
    MAX_SIZE_M,
    MAX_STL_BYTES,
    MAX_TRIANGLES,
    MIN_SIZE_M,
    Mesh,
    bounded_stl,
    load_mesh,
    repaired_solid,
    solid_of,
    sound_solid,
)
from glotouch_bt.robot.scene.object_files import MESH_SUFFIXES, load_folder, stl_files, twins_of
from glotouch_bt.robot.scene.placement import Placement, draw_layout, moved_apart, outline, place_objects
from glotouch_bt.robot.scene.stances import UPRIGHT, ByDigest, Quat, stances, standing, turned
from glotouch_bt.robot.scene.streams import stream
from glotouch_bt.robot.scene.world import Container, Holder, ObjectSet, Probe, World
