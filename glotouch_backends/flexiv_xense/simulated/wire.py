"""Messages between a simulated cell and its clients, pickled over a Unix socket that only we can open.

(NEW, class, args, kwargs) creates an object and answers with a `Reference`; (CALL, key, method, args, kwargs) calls it;
(REFEREE, question) asks the referee. An answer is (True, value) or (False, exception).
"""

from __future__ import annotations

from dataclasses import dataclass

NEW, CALL, REFEREE = "new", "call", "referee"


@dataclass(frozen=True)
class Reference:
    """Reference to an object in the cell."""

    key: int
