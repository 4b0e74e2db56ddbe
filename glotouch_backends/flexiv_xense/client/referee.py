"""The truth of a simulated world, asked over the link; the driver passes question and answer on unread."""

from __future__ import annotations

import pickle
from typing import cast

from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.driver import RefereeAnswer, RefereeRequest
from glotouch_bt.robot import Array, Pose
from glotouch_bt.robot.simulation import BareSteps, TrueObject


class RemoteReferee:
    """See `robot.referee.Referee`.

    Args:
        link: To a driver with simulated devices.
    """

    def __init__(self, link: DriverLink) -> None:
        self._link = link

    def _ask(self, method: str, *arguments: object) -> object:
        # What comes back was written by our own child process, over a socket only we can open.
        question = pickle.dumps((method, arguments))
        answer = self._link.ask(RefereeRequest(number=self._link.number(), question=question), RefereeAnswer)
        return cast("object", pickle.loads(answer.answer))

    def objects(self) -> list[TrueObject]:
        """All objects, now."""
        return cast("list[TrueObject]", self._ask("objects"))

    def pose_B_K(self) -> Pose:
        """The true container frame in B."""
        return cast("Pose", self._ask("pose_B_K"))

    def tip_B_m(self) -> Array:
        """(3,) true centre of the probe's ball."""
        return cast("Array", self._ask("tip_B_m"))

    def push_tip(self, force_B_N: Array) -> None:
        """Pull the probe by a force (3,) at the ball's centre from now on."""
        self._ask("push_tip", force_B_N)

    def probe_in_holder(self) -> bool:
        """True if the probe stands in its holder."""
        return bool(self._ask("probe_in_holder"))

    def peak_force_N(self) -> float:
        """Largest true contact force so far."""
        return float(cast("float", self._ask("peak_force_N")))

    def replay_bare_steps(self) -> BareSteps | None:
        """None: steps are not remembered here."""
        return None
