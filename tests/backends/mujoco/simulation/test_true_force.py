"""The longest run of samples beyond the limit, also across periods."""

import numpy as np

from glotouch_backends.mujoco.simulation import TrueForce


def test_the_longest_run_beyond_the_limit_goes_on_in_the_next_period() -> None:
    force = TrueForce()
    for forces_N in ([1.0, 31.0, 2.0], [3.0, 32.0, 33.0], [40.0, 2.0, 31.0], [5.0, 6.0, 7.0], [31.0, 1.0, 1.0]):
        force.note(np.array(forces_N) ** 2)
    assert force.peak_N == 40.0
    assert force.samples_over == 3
