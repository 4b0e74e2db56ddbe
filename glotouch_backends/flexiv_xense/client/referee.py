"""Ground truth of a simulated world over the link; the driver forwards question and answer undecoded."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.driver import messages


class RemoteReferee:
    """A `robot.simulation.Referee` whose every method asks the world's own referee.

    Args:
        link: Connection to a driver with simulated devices.
    """

    def __init__(self, link: DriverLink) -> None:
        self._link = link

    def __getattr__(self, method: str) -> Callable[..., Any]:
        if method.startswith("_"):
            raise AttributeError(method)

        def ask(*arguments: object) -> Any:
            question = messages.RefereeRequest(number=self._link.number(), question=pickle.dumps((method, arguments)))
            # Pickle is safe here: our own child process wrote the answer, over a socket only we can open.
            return pickle.loads(self._link.ask(question, messages.RefereeAnswer).answer)

        return ask
