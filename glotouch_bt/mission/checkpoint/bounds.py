"""Bound the number of values in a MessagePack message before any of them is made."""

from __future__ import annotations

from glotouch_bt.robot import BadInput

MAX_VALUES = 2_000_000
"""Maximum number of values in a message, shared ones counted repeatedly (0.3 GB). Source: 100 times the largest."""
_SIZES = {0xC0: 0, 0xC2: 0, 0xC3: 0, 0xCA: 4, 0xCB: 8, 0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8, 0xD0: 1, 0xD1: 2, 0xD2: 4,
          0xD3: 8, 0xD4: 2, 0xD5: 3, 0xD6: 5, 0xD7: 9, 0xD8: 17}  # fmt: skip
"""Bytes after the first one, of values of a fixed size."""
_LENGTHS = {0xC4: 1, 0xC5: 2, 0xC6: 4, 0xC7: 1, 0xC8: 2, 0xC9: 4, 0xD9: 1, 0xDA: 2, 0xDB: 4}
"""Bytes of the length of text, bytes and extensions."""
_COUNTS = {0xDC: 2, 0xDD: 4, 0xDE: 2, 0xDF: 4}
"""Bytes of the count of a list or mapping."""


def require_few_values(data: bytes) -> None:
    """Require a message to hold at most `MAX_VALUES` values, and no list that announces more than follow.

    Raises:
        BadInput: It does not.
    """
    at, end, seen, announced = 0, len(data), 0, 1
    while at < end and seen < announced:
        code = data[at]
        at += 1
        seen += 1
        if code < 0x80 or code >= 0xE0:
            continue
        if code < 0x90:
            announced += 2 * (code & 15)
        elif code < 0xA0:
            announced += code & 15
        elif code < 0xC0:
            at += code & 31
        elif code in _SIZES:
            at += _SIZES[code]
        elif code in _LENGTHS:
            width = _LENGTHS[code]
            at += width + int.from_bytes(data[at : at + width], "big") + (0xC7 <= code <= 0xC9)
        elif code in _COUNTS:
            width = _COUNTS[code]
            announced += int.from_bytes(data[at : at + width], "big") * (2 if code >= 0xDE else 1)
            at += width
        if announced > MAX_VALUES or announced - seen > end - at + 1:
            raise BadInput(f"checkpoint values cannot be read (more than {MAX_VALUES}, or fewer than announced)")
