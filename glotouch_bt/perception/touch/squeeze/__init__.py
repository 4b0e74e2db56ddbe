"""Evidence from one closure of the jaws: plateau, depth-map patches and motion of the object."""

from glotouch_bt.perception.touch.squeeze.object_motion import ObjectMotion, estimate_object_motion
from glotouch_bt.perception.touch.squeeze.patches import evidence_weight, patch_statistics, relative_nonplanarity
from glotouch_bt.perception.touch.squeeze.plateau import find_plateau, make_layer, temporal_median
