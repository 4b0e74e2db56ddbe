"""The jaws' zero as a mission measures it, against the bias the conditions drew."""

from __future__ import annotations

import pytest

from glotouch_bt.bench.detection.simulated import SimulatedProbe
from glotouch_bt.perception.touch.calibration.jaw_zero import measured_zero
from glotouch_bt.robot.scene.streams import stream


@pytest.mark.parametrize(("conditions", "seed", "limit_m"), [("nominal", 7, 0.4e-3), ("harsh", 8, 1.0e-3)])
def test_the_handle_tells_the_zero(conditions: str, seed: int, limit_m: float) -> None:
    """Within 0.1 mm, four times the reports' noise over 0.2 s; unmeasured it is off by up to `limit_m`."""
    rig = SimulatedProbe(conditions, seed)
    with rig.robot:
        arm = rig.context.arm
        seen = rig.go(arm.hold(0.2, tactile=True))
        zero = measured_zero(seen, rig.world.probe.handle_m[1], arm.description.gripper.pad_shape)
    true_m = float(stream(seed, "aperture_bias").uniform(-limit_m, limit_m))
    assert zero.error_m == pytest.approx(true_m, abs=1e-4)
    assert abs(true_m) > 1e-4, "a seed that shows something"
