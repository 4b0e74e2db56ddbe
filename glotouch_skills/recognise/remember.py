"""Store the touches of an object, so that it can be found again without a mesh."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from glotouch_bt import perception
from glotouch_bt.perception import recognition
from glotouch_bt.perception.recognition import Encounter, Match, PadSpec, TouchedObject, beyond_jaws_m, encounter_of
from glotouch_bt.perception.touch import TouchSet, evidence_weight
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param


class RememberParams(SkillParams):
    """Parameters of `remember`.

    Closures turn objects, so right outlines reach beyond the jaws, too: 14 mm at most for nine objects, 18 mm for a
    tenth (seed 58651). When the tenth had moved while it was traced, its outline reached 31 mm beyond them. Source:
    records of `glotouch run remember --conditions realistic` at 3cd1d81a, on the objects of `any_shape.py --seed 8895
    --count 10`, seeds 58601-58610.
    """

    object: str = param(
        "Name of the object, of letters, digits, _ and -; it is retrieved as touched:NAME",
        pattern=perception.TOUCHED_NAME_PATTERN,  # refused before the run, not at its end
    )
    same: float = param(
        "Least probability that the touches are of the object stored under this name", default=0.5, gt=0.0, lt=1.0
    )
    min_layers: int = param("Least number of closures that both pads felt", default=4, ge=1, le=100)
    beyond_m: float = param(
        "Largest distance by which the outline may reach beyond the closed jaws", unit="m", default=0.02, gt=0.0
    )


class Remember(Skill):
    """Store outline, height, widths and images of the object that was squeezed, in touched/NAME.json.

    Nothing is stored if the jaws closed farther than the outline allows: the object probably moved during its trace. If
    something was stored under this name, the touches must be of the same object. They are turned and moved into its
    frame and added, so that the object is known better after every encounter.

    SUCCESS: `stored` is the file.
    """

    Params = RememberParams
    params: RememberParams

    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it computes

    TOO_LITTLE = Failure(
        "too_little_felt",
        "the top was not touched, or too few closures felt the object",
        advice="squeeze it again; `squeeze` says why closures failed",
    )
    OTHER_OBJECT = Failure(
        "other_object",
        "another object is stored under this name",
        advice="choose another name, or delete the file to forget the object",
    )
    NOT_AS_TRACED = Failure(
        "not_as_traced",
        "the jaws closed farther than the outline allows: the object probably moved when traced; nothing is stored",
        advice="remember it again",
    )

    touchset = In(TouchSet, "the touches of the object")
    stored = Out(str, "the file", result=lambda path: f"remembered in {path}")
    encounters = Out(int, "number of encounters that are remembered")

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD  # comparing with what is stored takes longer than a control period
        touchset: TouchSet = self.touchset
        layers = sum(evidence_weight(layer) >= 1.0 for layer in touchset.layers)
        if not touchset.candidate.top_touched or layers < self.params.min_layers:
            raise self.TOO_LITTLE(
                f"both pads felt {layers} closures, and {self.params.min_layers} are needed; the top was "
                + ("touched" if touchset.candidate.top_touched else "not touched"),
                layers=layers,
            )
        path, pad = (
            perception.touched_path(self.params.object),
            perception.pads_of(self.context.arm.description.gripper),
        )
        if path.exists():
            felt = self._grown(perception.read_touched(self.params.object), touchset, pad)
        else:
            felt = TouchedObject(self.params.object, (encounter_of(touchset, pad),))
        beyond_m = self._require_as_traced(felt.encounters[-1], touchset, pad)
        self.stored, self.encounters = str(perception.write_touched(felt)), len(felt.encounters)
        self.event(
            "remembered", name=felt.name, file=self.stored, encounters=self.encounters, layers=layers, beyond_m=beyond_m
        )
        self._tell(felt, pad, beyond_m)

    def _require_as_traced(self, encounter: Encounter, touchset: TouchSet, pad: PadSpec) -> float:
        """Return how far the outline reaches beyond the closed jaws, m.

        Raises:
            SkillFailed: `not_as_traced`.
        """
        heights_m = [float(c.tip_K_m[2]) for c in touchset.candidate.contacts]
        beyond_m = beyond_jaws_m(encounter, float(np.mean(heights_m)), pad) if heights_m else 0.0
        if beyond_m > self.params.beyond_m:
            raise self.NOT_AS_TRACED(
                f"the object probably moved while it was traced: its outline reaches {beyond_m * 1e3:.0f} mm beyond "
                f"the closed jaws, {self.params.beyond_m * 1e3:.0f} mm at most are expected",
                beyond_m=beyond_m,
                limit_m=self.params.beyond_m,
            )
        return beyond_m

    def _grown(self, known: TouchedObject, touchset: TouchSet, pad: PadSpec) -> TouchedObject:
        """Return the object with one more encounter, in its own frame.

        Raises:
            SkillFailed: `other_object`.
        """
        model = recognition.touched_model(known, pad)
        ranking = recognition.MATCHERS["likelihood"](model, (touchset,))
        best: Match = ranking.best
        if best.probability < self.params.same:
            raise self.OTHER_OBJECT(
                f"the touches are of {known.name} with a probability of {best.probability:.2f} only",
                probability=best.probability,
                least=self.params.same,
            )
        # The closures moved the object. Before them, its traced centre was that of the outline.
        theta = best.pose_K_O[2]
        turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
        contour = touchset.candidate.contour
        x, y = (np.asarray(contour.centre_K_m) - turn @ model.outline.of(contour.kind).centre_m).tolist()
        return known.grown(encounter_of(touchset, pad, (x, y, theta)))

    def _tell(self, felt: TouchedObject, pad: PadSpec, beyond_m: float) -> None:
        """Add a section to the report."""
        model = recognition.touched_model(felt, pad)
        assert model.certainty is not None
        inner = np.abs(model.l_m) <= 0.5 * pad.window_m[0]
        known = model.certainty.width_known[:, inner]
        rows = [
            [str(i + 1), e.contour.family or "", f"{e.contour.size_m[0] * 1e3:.1f} x {e.contour.size_m[1] * 1e3:.1f}",
             f"{e.height_m * 1e3:.1f}", str(len(e.closures)), str(sum(c.two_sided for c in e.closures))]
            for i, e in enumerate(felt.encounters)
        ]  # fmt: skip
        self.report(
            f"Remembered as {felt.name}",
            f"{100 * float(known.mean()):.0f} % of the widths through its middle are known to about 2.5 mm or better. "
            f"The outline reaches {beyond_m * 1e3:.0f} mm beyond the closed jaws. "
            f"Retrieve it with --set target=touched:{felt.name}.",
            ["encounter", "outline", "size, mm", "height, mm", "closures", "felt by both pads"],
            rows,
        )
