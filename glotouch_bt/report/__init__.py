"""The report of a run: `read_run` returns its arrays and events, `write_report` writes report.html."""

from glotouch_bt.report.run_record import PortWrite, RecordedEvent, RunRecord, Tick, read_run
from glotouch_bt.report.write import write_report

__all__ = ["PortWrite", "RecordedEvent", "RunRecord", "Tick", "read_run", "write_report"]
