"""Evidence from one closure of the jaws: plateau, depth-map patches and motion of the object."""

from glotouch_bt.perception.touch.squeeze.object_motion import ObjectMotion, estimate_object_motion
from glotouch_bt.perception.touch.squeeze.patches import (
    contact_threshold_m,
    evidence_weight,
    layer_patches,
    mean_depth_m,
    pad_noise_m,
    patch_statistics,
    relative_nonplanarity,
    temporal_median,
)
from glotouch_bt.perception.touch.squeeze.plateau import find_plateau, make_layer
from glotouch_bt.perception.touch.squeeze.relief import (
    BLOCKS,
    relief_of_closure,
    relief_of_images,
    relief_of_surface,
)
