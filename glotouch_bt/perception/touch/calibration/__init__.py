"""TODO door of glotouch_bt/perception/touch/calibration."""

from glotouch_bt.perception.touch.calibration.jaw_zero import MEASURED_SD_M, JawZero, measured_zero
from glotouch_bt.perception.touch.calibration.latency import LatencyEstimate, latency_from_two_speeds
from glotouch_bt.perception.touch.calibration.tip_offset import TipCalibration, WallTouch, solve_tip, wrench_delay

__all__ = [
    "MEASURED_SD_M",
    "JawZero",
    "LatencyEstimate",
    "TipCalibration",
    "WallTouch",
    "latency_from_two_speeds",
    "measured_zero",
    "solve_tip",
    "wrench_delay",
]
