"""Write and read the record of a run: one MCAP file with everything sensed, commanded, ticked and decided."""

from glotouch_bt.mission.record.event_words import (
    HIDDEN_EVENTS,
    OBJECTS_RESULT,
    event_tone,
    event_words,
    fields_in_words,
    objects_in_words,
    short_text,
)
from glotouch_bt.mission.record.mcap_chunks import (
    BROKEN,
    MAX_RECORD_BYTES,
    MCAP_MAGIC,
    ChunkUnpacker,
    open_record,
    read_chunks,
    record_items,
)
from glotouch_bt.mission.record.mcap_json import Json, to_json
from glotouch_bt.mission.record.mcap_packing import join, unpack
from glotouch_bt.mission.record.mcap_schemas import EVENT_PREFIX
from glotouch_bt.mission.record.recorded_requests import REQUEST_DONE, RecordedRequests
from glotouch_bt.mission.record.recorder import RESULT_ATTACHMENT, RUN_ATTACHMENT, Recorder
from glotouch_bt.mission.record.rounding import STAMP_S, Rounding, to_step
from glotouch_bt.mission.record.run_summary import NullRecord, Record, RunSummary
