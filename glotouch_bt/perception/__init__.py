"""Perception: touch (contacts and outlines), search (where to probe) and recognition (which object it is)."""

from typing import TYPE_CHECKING

from glotouch_bt.lazy import lazy_door

if TYPE_CHECKING:
    from glotouch_bt.perception.fragments import joined
    from glotouch_bt.perception.model_cache import target_model
    from glotouch_bt.perception.reach import TooLow, model_for, pads_of, too_wide
    from glotouch_bt.perception.sides import model_with_sides
    from glotouch_bt.perception.touched_files import (
        TOUCHED_NAME_PATTERN,
        read_touched,
        touched_name,
        touched_path,
        write_touched,
    )

__getattr__ = lazy_door(
    __name__,
    joined="fragments",
    target_model="model_cache",
    model_with_sides="sides",
    **dict.fromkeys(("TooLow", "model_for", "pads_of", "too_wide"), "reach"),
    **dict.fromkeys(
        ("TOUCHED_NAME_PATTERN", "read_touched", "touched_name", "touched_path", "write_touched"), "touched_files"
    ),
)
