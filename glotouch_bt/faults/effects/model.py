"""Faults of the model the mission is given: an STL in the wrong scale. They are there from the start."""

from __future__ import annotations

from glotouch_bt.faults.effects.base import Effect, FaultParams, param


class ScaleParams(FaultParams):
    """Parameters of `wrong_scale_stl`."""

    factor: float = param("The model is so many times as large as the object", default=1.15, ge=0.2, le=5.0)


class WrongScale(Effect):
    """The target's STL was made for another unit, or another size of the object; the real one stays as it is."""

    Params = ScaleParams
    params: ScaleParams

    def prepare(self) -> None:
        """See `Effect`; the model was replaced when the mission was loaded (`models.wrong_models`)."""
        self.acts.times += 1
        self.acts.notes.append(f"the model is {self.params.factor:g} times as large as the object")
