"""Ground truth of a simulated world over the link; the driver forwards question and answer undecoded."""

from __future__ import annotations

import pickle
from typing import cast

from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.driver import RefereeAnswer, RefereeRequest
from glotouch_bt.robot import Array, Pose
from glotouch_bt.robot.simulation import BareSteps, TrueObject


class RemoteReferee:
    """See `robot.simulation.Referee`.

    Args:
        link: Connection to a driver with simulated devices.
    """

    def __init__(self, link: DriverLink) -> None:
        self._link = link

    def _ask(self, method: str, *arguments: object) -> object:
        # Pickle is safe here: our own child process wrote the answer, over a socket only we can open.
        question = pickle.dumps((method, arguments))
        answer = self._link.ask(RefereeRequest(number=self._link.number(), question=question), RefereeAnswer)
        return cast("object", pickle.loads(answer.answer))

    def objects(self) -> list[TrueObject]:
        """See `Referee`."""
        return cast("list[TrueObject]", self._ask("objects"))

    def pose_B_K(self) -> Pose:
        """See `Referee`."""
        return cast("Pose", self._ask("pose_B_K"))

    def tip_B_m(self) -> Array:
        """See `Referee`."""
        return cast("Array", self._ask("tip_B_m"))

    def push_tip(self, force_B_N: Array) -> None:
        """See `Referee`."""
        self._ask("push_tip", force_B_N)

    def probe_in_holder(self) -> bool:
        """See `Referee`."""
        return bool(self._ask("probe_in_holder"))

    def peak_force_N(self) -> float:
        """See `Referee`."""
        return float(cast("float", self._ask("peak_force_N")))

    def replay_bare_steps(self) -> BareSteps | None:
        """Return None: this backend records no steps."""
        return None
