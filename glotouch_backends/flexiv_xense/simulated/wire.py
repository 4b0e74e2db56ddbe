"""What a simulated cell and its clients say to each other, pickled over a Unix socket that only we can open.

(NEW, class, args, kwargs) makes an object and answers a `Reference`; (CALL, key, method, args, kwargs) calls it;
(REFEREE, question) asks the truth. An answer is (True, value) or (False, exception).
"""

from __future__ import annotations

from dataclasses import dataclass

NEW, CALL, REFEREE = "new", "call", "referee"


@dataclass(frozen=True)
class Reference:
    """Stands for an object that lives in the cell."""

    key: int
