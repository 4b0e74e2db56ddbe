"""`bench detection`: the contact guard's operating curve, in synthetic signals and in a simulation."""

from glotouch_bt.bench.detection.bench import DetectionStudy, run_study, table

__all__ = ["DetectionStudy", "run_study", "table"]
