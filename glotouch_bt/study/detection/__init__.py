"""`bench detection`: the contact guard's operating curve, in synthetic signals and in a simulation."""

from glotouch_bt.study.detection.bench import DetectionStudy, run_study, table

__all__ = ["DetectionStudy", "run_study", "table"]
