"""`bench detection`: false alarms and sensitivity of the contact guard, on synthetic and simulated signals."""

from glotouch_bt.bench.detection.bench import DetectionStudy, run_study, table
