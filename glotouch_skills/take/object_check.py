"""Check by width and weight whether the object in the hand can be the target."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from glotouch_bt.robot import HOLD, Array
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import GRAVITY_M_S2
from glotouch_skills.common.planning import SHIFTS_M, TOO_LOW, GraspPlan, find_target

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import TargetModel

HEIGHT_SLACK_M = 0.006
"""The object may be held this much higher or lower than planned: it was lifted at an edge, or stood on something."""


class ObjectCheckParams(SkillParams):
    """Parameters of `object_check`.

    A gel yields by its depth at most, so the aperture is between the mesh's width and that width less both depths. It
    was 0.8 to 3.0 mm below the width for 14 of 14 retrieved objects (30 N, gels of 1.5 mm). Densities range from balsa
    wood to tungsten, so the weight only excludes the impossible.
    """

    target: str = param(
        "The object wanted: an STL file, the name of one in the world's object folder, or touched:NAME", names="stl"
    )
    width_m: float = param("Largest deviation from that range", unit="m", default=0.0025, gt=0.0, le=0.02)
    lightest_kg_m3: float = param("Least density of the target", unit="kg/m3", default=100.0, gt=0.0)
    heaviest_kg_m3: float = param("Largest density of the target", unit="kg/m3", default=20000.0, gt=0.0)


class ObjectCheck(Skill):
    """Compare the aperture with the planned width, and the weight with the mesh's volume.

    The aperture is that before the lift: an object may turn between the jaws while it is lifted.

    SUCCESS: the object can be the target; `fits` is true.
    """

    Params = ObjectCheckParams
    params: ObjectCheckParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"})}
    POSTCONDITIONS: ClassVar = {"hand": "object"}
    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it computes

    NOT_AS_FELT = Failure(
        "not_as_felt",
        "the target is this wide somewhere at that height, but not where the plan took it: what was felt of "
        "it no longer holds, or never did; it may be touched again",
        advice="put it back and touch it again",
    )
    WRONG_OBJECT = Failure(
        "wrong_object",
        "the target is nowhere this wide at that height, or cannot weigh this much",
        advice="put it back and try the next candidate",
    )
    FAILURES: ClassVar = (TOO_LOW,)

    made = In(GraspPlan, "how it was taken")
    weight_N = In(float, "weight in the hand, N", key="weight")
    fits = Out(bool, "it can be the target", always=True, on_success=True)
    impossible = Out(bool, "it cannot be the target, however it was taken", always=True)

    def run(self) -> SkillRun:
        """See the class."""
        self.fits, self.impossible = False, False
        yield HOLD  # the model may have to be read from disk
        p, made = self.params, self.made
        gripper = self.context.arm.description.gripper
        target = find_target(p.target, self.context.world.objects, gripper)
        name = target.name
        low_m3, high_m3 = target.volume_m3
        light, heavy = GRAVITY_M_S2 * p.lightest_kg_m3 * low_m3, GRAVITY_M_S2 * p.heaviest_kg_m3 * high_m3
        give = 2.0 * gripper.pad_depth_m
        grip_m = made.aperture_m if made.closed_m is None else made.closed_m
        off = misfit_m(np.array(made.aperture_m), grip_m, give).item()
        self.event("object_check", grip_m=grip_m, off_m=off, weight_N=self.weight_N, light_N=light, heavy_N=heavy)
        if not light <= self.weight_N <= heavy:
            self.impossible = True
            raise self.WRONG_OBJECT(
                f"{name} would weigh {light:.2f} N (balsa wood) to {heavy:.1f} N (tungsten); "
                f"this weighs {self.weight_N:.2f} N",
                weight_N=self.weight_N,
                light_N=light,
                heavy_N=heavy,
            )
        if off <= p.width_m:
            self.fits = True
            return
        widths, unsure = widths_m(target.model.standing(made.quat), float(made.position_K_m[2]))
        misfits = np.maximum(misfit_m(widths, grip_m, give) - unsure, 0.0)
        least = float(misfits.min(initial=gripper.stroke_m))
        if least <= p.width_m:
            raise self.NOT_AS_FELT(
                f"the jaws stopped at {grip_m * 1e3:.1f} mm where {made.aperture_m * 1e3:.1f} mm were planned; "
                f"{name} is that wide elsewhere",
                off_m=off,
                limit_m=p.width_m,
            )
        self.impossible = True
        raise self.WRONG_OBJECT(
            f"the jaws stopped at {grip_m * 1e3:.1f} mm; wherever {name} is held at this height, they would "
            f"stop at least {least * 1e3:.1f} mm from there",
            off_m=off,
            min_m=least,
            limit_m=p.width_m,
        )


def misfit_m(width_m: Array, grip_m: float, give_m: float) -> Array:
    """Return the distance of `grip_m` from the valid range, which reaches from the width to `give_m` below it."""
    return np.asarray(np.maximum(np.maximum(grip_m - width_m, width_m - give_m - grip_m), 0.0))


def widths_m(model: TargetModel, height_m: float) -> tuple[Array, Array]:
    """Return the model's widths (n,) near a height, at any yaw, and by how much each may be wrong (0 of a mesh).

    Use only places where a grasp would be planned, since anything is narrow at the ends of the mesh.
    """
    level = np.abs(model.z_m - height_m) <= HEIGHT_SLACK_M
    inner = np.abs(model.l_m) <= SHIFTS_M
    widths = model.width_m[:, inner][:, :, level].astype(np.float64).ravel()
    unsure = np.zeros_like(widths)
    if model.certainty is not None:
        unsure = 2.0 * model.certainty.width_sd_m[:, inner][:, :, level].astype(np.float64).ravel()
    some = np.isfinite(widths)
    return widths[some], unsure[some]
