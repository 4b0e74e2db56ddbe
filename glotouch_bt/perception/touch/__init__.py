"""Pure functions of touch: contact detection, outline estimation, squeeze evidence and sensor calibration."""

from glotouch_bt.perception.touch.detection import (
    Baseline,
    ContactGuard,
    GuardParams,
    HardStop,
    HardTrip,
    LowPass,
    MeasuredInertia,
    Onset,
    Payload,
    TipFusion,
    contact_direction,
    contact_point,
    fit_baseline,
    settled,
)
from glotouch_bt.perception.touch.outline import (
    area_and_centroid,
    contour_quality,
    current_tips,
    estimate_push,
    fit_contour,
    fit_kind,
    infer_outline,
    infer_outline_from_contacts,
    minimum_rectangle,
    polygon_distance,
    signed_distance,
    split_at_motion,
)
from glotouch_bt.perception.touch.squeeze import (
    ObjectMotion,
    contact_threshold_m,
    estimate_object_motion,
    evidence_weight,
    find_plateau,
    layer_patches,
    make_layer,
    mean_depth_m,
    pad_noise_m,
    patch_statistics,
    relative_nonplanarity,
    temporal_median,
)
from glotouch_bt.perception.touch.values import Candidate, Contact, Contour, ContourKind, Layer, TouchSequence, TouchSet
