"""The one reader of everything a stranger may have written, and the one writer beside it. Bounded, typed, no links.

Missions, objects, fault plans, run folders, records and caches are untrusted: `docs/security.md`. Other modules open no
such file themselves; a test holds that.
"""

from glotouch_bt.untrusted.files import (
    copy_file,
    create_file,
    open_file,
    read_file,
    read_start,
    require_plain,
    write_file,
)
from glotouch_bt.untrusted.texts import MAX_JSON_BYTES, TooLarge, parse_json, read_json, unpack_zstd
from glotouch_bt.untrusted.typed import field_types, require_type
