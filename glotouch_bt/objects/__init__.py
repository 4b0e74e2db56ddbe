"""A user's meshes made into objects: read, convert, repair, stand upright, judge, and write as a clean folder.

`files`, `repair` and `sides` know meshes only; `jaws` and `alike` ask what a gripper and the recogniser can do.
"""

from glotouch_bt.objects.alike import LookAlike, look_alikes
from glotouch_bt.objects.files import UNITS_M, mesh_files
from glotouch_bt.objects.folder import check_free, write_clean
from glotouch_bt.objects.page import closures_in_words, page, side_in_words, size_in_words
from glotouch_bt.objects.prepare import Prepared, RefusedFile, chosen_sides, prepare
