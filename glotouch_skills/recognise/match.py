"""Decide which squeezed candidate is the target."""

from __future__ import annotations

import math
from pathlib import Path
from typing import ClassVar, Literal

from glotouch_bt import perception
from glotouch_bt.perception import recognition
from glotouch_bt.perception.recognition import Ranking
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD, BadInput, ParamError
from glotouch_bt.robot.scene import Mesh, load_folder, load_mesh
from glotouch_bt.skill import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from glotouch_skills.common.planning import GraspPlan, plan_grasp


class MatchParams(SkillParams):
    """Parameters of `match`."""

    target: str = param("The object to find: an STL file, or the name of one in the world's object folder", names="stl")
    matcher: Literal["likelihood", "paper"] = param("How candidates are compared", default="likelihood")


class Match(Skill):
    """Rank all TouchSets against the target's STL and plan the grasp of the best.

    SUCCESS: the best candidate is surely enough the target and was felt enough; `plan` says how to grasp it.
    FAILURE `not_recognised`: it does not; `ranking` is written all the same.
    FAILURE `too_wide`: the same, and the jaws do not open wide enough for the target.
    FAILURE `too_low`: the target is lower than the probe and the pads reach.
    FAILURE `no_touch`: nothing was squeezed.
    """

    Params = MatchParams
    params: MatchParams

    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it thinks
    FAILURES: ClassVar = {
        "not_recognised": "no candidate is surely the target",
        "too_wide": "the same, and the jaws do not open wide enough for the target",
        "too_low": "the target is lower than the probe and the pads reach",
        "no_touch": "nothing was squeezed",
    }

    touchsets = In(tuple, "one TouchSet per candidate squeezed", element=TouchSet, required=False)
    known = In(
        tuple, "all candidates, to say which were not squeezed", key="candidates", element=Candidate, required=False
    )
    rejected = In(tuple, "indices of candidates that were found not to be it", required=False)
    ranking = Out(Ranking, "all candidates, best first")
    plan = Out(GraspPlan, "how to grasp the best one")

    def run(self) -> SkillRun:
        """See the class."""
        rejected = self.rejected or ()
        touchsets = tuple(t for t in self.touchsets or () if t.candidate.index not in rejected)
        if not touchsets:
            raise SkillFailed(
                "no_touch",
                "no candidate was squeezed, so nothing can be recognised",
                advice="squeeze the candidates first; the squeezes' own failures say why none was felt",
                candidates=len(self.known or ()),
                rejected=len(rejected),
            )
        yield HOLD  # matching takes longer than a control period; on hardware the arm holds meanwhile
        gripper = self.context.arm.description.gripper
        mesh = self._target()
        try:
            model = perception.target_model(
                mesh, recognition.PadSpec(gripper.pad_window_m, gripper.pad_shape, gripper.pad_depth_m)
            )
        except ParamError as e:
            raise SkillFailed("too_low", f"{mesh.name} cannot be felt: {e}", advice="sweep lower") from e
        ranking = recognition.MATCHERS[self.params.matcher](model, touchsets)
        self.ranking = ranking
        self.event("ranking", target=mesh.name, ranking=ranking, gates=ranking.gates, matcher=self.params.matcher)
        if not ranking.accepted:
            felt = {t.candidate.index for t in touchsets} | set(rejected)
            missed = [str(c.index) for c in self.known or () if c.index not in felt]
            why = "; ".join(ranking.reasons) + (f"; not squeezed: candidate {', '.join(missed)}" if missed else "")
            if model.narrowest_m > gripper.stroke_m:
                raise SkillFailed(
                    "too_wide",
                    f"{mesh.name} is {model.narrowest_m * 1e3:.0f} mm across at its narrowest and the jaws open "
                    f"{gripper.stroke_m * 1e3:.0f} mm ({why})",
                    advice="use a wider gripper",
                    narrowest_m=model.narrowest_m,
                )
            raise SkillFailed(
                "not_recognised",
                f"no candidate is surely {mesh.name}: {why}",
                advice=_advice(ranking),
                margin=ranking.margin,
            )
        best = next(t for t in touchsets if t.candidate.index == ranking.best.index)
        self.plan = plan_grasp(best, ranking.best, mesh, model, gripper)
        self.event("plan", plan=self.plan)

    def _target(self) -> Mesh:
        return load_target(self.params.target, self.context.world.objects.folder)


def _advice(ranking: Ranking) -> str:
    """What would help most."""
    c = ranking.next_touch
    if c is None:
        return "touch more"
    yaw = math.degrees(math.remainder(c.yaw_K_rad, math.pi))
    return f"touch candidate {c.candidate} {c.height_m * 1e3:.0f} mm above the floor, hand turned to {yaw:.0f} degrees"


def load_target(target: str, folder: Path) -> Mesh:
    """The target's mesh: `target` is a path to an STL, or a stem in `folder`.

    Raises:
        BadInput: Neither is a usable STL.
    """
    if target.lower().endswith(".stl"):
        return load_mesh(Path(target))
    if not target:
        raise BadInput("the target is an empty name; give an STL file or the name of one in the object folder")
    return load_folder(folder, (target,))[0]
