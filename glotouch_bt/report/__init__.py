"""What a person looks at after a run: `write_report` makes report.html, `read_run` gives its arrays and events."""

from glotouch_bt.report.run_record import PortWrite, RecordedEvent, RunRecord, Tick, read_run
from glotouch_bt.report.write import write_report

__all__ = ["PortWrite", "RecordedEvent", "RunRecord", "Tick", "read_run", "write_report"]
