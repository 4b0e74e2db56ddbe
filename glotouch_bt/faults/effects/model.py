"""Faults of the model given to the mission: an STL in the wrong scale, present from the start."""

from __future__ import annotations

from glotouch_bt.faults.effects.base import Effect, FaultParams, param


class WrongScaleStlParams(FaultParams):
    """Parameters of `wrong_scale_stl`."""

    factor: float = param("Size of the model relative to the object", default=1.15, ge=0.2, le=5.0)


class WrongScaleStl(Effect[WrongScaleStlParams]):
    """The target's STL has the wrong scale; the real object does not change."""

    def prepare(self) -> None:
        """See `Effect`. `models.wrong_models` replaced the model when the mission was loaded."""
        self.actions.count += 1
        self.actions.notes.append(f"the model is {self.params.factor:g} times as large as the object")
