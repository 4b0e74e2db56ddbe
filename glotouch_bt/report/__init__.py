"""The report of a run: `read_run` returns its arrays and events, `write_report` writes report.html."""

from glotouch_bt.report.run_record import RecordedEvent, RecordReader, RunRecord, read_run
from glotouch_bt.report.write import write_report
