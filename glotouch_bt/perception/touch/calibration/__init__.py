"""Calibration from touches: jaw zero, tip offset, wrist latency and the probe's compliance."""

from glotouch_bt.perception.touch.calibration.compliance import UNMEASURED_M_N, Press, solve_compliance
from glotouch_bt.perception.touch.calibration.jaw_zero import MEASURED_SD_M, JawZero, measured_zero
from glotouch_bt.perception.touch.calibration.tip_offset import TipCalibration, WallTouch, solve_tip, wrench_delay
