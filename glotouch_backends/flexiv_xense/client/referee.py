"""Ground truth of a simulated world over the link."""

from __future__ import annotations

import numpy as np

from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.driver import messages
from glotouch_backends.trial_message import pose_of
from glotouch_bt.robot import Array, Pose
from glotouch_bt.robot.scene import AXES
from glotouch_bt.robot.simulation import BareSteps, TrueObject


class RemoteReferee:
    """A `robot.simulation.Referee` that asks the world's own referee; each method may raise a BackendError.

    Args:
        link: Connection to a driver with simulated devices.
    """

    def __init__(self, link: DriverLink) -> None:
        self._link = link

    def _ask(self, method: str, force_B_N: tuple[float, ...] = (0.0, 0.0, 0.0)) -> messages.RefereeAnswer:
        number = self._link.number()
        request = messages.RefereeRequest(number=number, method=method, force_B_N=force_B_N)  # type: ignore[arg-type]
        return self._link.ask(request, messages.RefereeAnswer)

    def objects(self) -> list[TrueObject]:
        """See `Referee`."""
        return [
            TrueObject(
                o.name, pose_of(o.pose_B_O), o.mass_kg, np.array(o.outline_B_m), o.in_gripper, np.array(o.size_m)
            )
            for o in self._ask("objects").objects
        ]

    def pose_B_K(self) -> Pose:
        """See `Referee`."""
        return pose_of(self._ask("pose_B_K").numbers)

    def tip_B_m(self) -> Array:
        """See `Referee`."""
        return np.array(self._ask("tip_B_m").numbers)

    def push_tip(self, force_B_N: Array) -> None:
        """See `Referee`."""
        self._ask("push_tip", tuple(force_B_N.tolist()))

    def probe_in_holder(self) -> bool:
        """See `Referee`."""
        return self._ask("probe_in_holder").numbers == (1.0,)

    def peak_force_N(self) -> float:
        """See `Referee`."""
        return self._ask("peak_force_N").numbers[0]

    def samples_over_limit(self) -> int:
        """See `Referee`."""
        return int(self._ask("samples_over_limit").numbers[0])

    def contact_softness_s(self) -> float:
        """See `Referee`."""
        return self._ask("contact_softness_s").numbers[0]

    def silent_axes(self) -> tuple[str, ...]:
        """See `Referee`; the answer holds their places in `AXES`."""
        return tuple(AXES[int(i)] for i in self._ask("silent_axes").numbers)

    def replay_bare_steps(self) -> BareSteps | None:
        """See `Referee`; None, because the driver keeps no trace."""
        return None
