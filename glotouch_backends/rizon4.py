"""The Flexiv Rizon 4 with a Xense-like parallel gripper, as numbers; shared by the simulator and the hardware backend.

Kinematics and inertia: the vendor's description (flexivrobotics/flexiv_description, config/Rizon4). An independent
model agrees with it (google-deepmind/mujoco_menagerie, flexiv_rizon4) and gives the armature.
Position ranges: the vendor's RDK v1.5 URDF, at each end 0.0873 rad (5 degrees) inside those of the description.
"""

from __future__ import annotations

from math import pi

import numpy as np

from glotouch_bt.robot import Box, Capsule, Gripper, Joint, Link, Pose, RobotDescription

Vec3 = tuple[float, float, float]
Inertia = tuple[float, float, float, float, float, float]
Y, Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

# Inertia (ixx, iyy, izz, ixy, ixz, iyz) about the centre of mass: vendor numbers, coarse on purpose ("blurred" in the
# vendor's words); a test checks that each is positive definite and obeys the triangle inequality.
# Capsules: from one joint's origin to the next, with the housing's radius rounded up. Source: ours.
# Base and links: (mass kg, centre of mass m, inertia kg m2, start m, end m and radius m of the capsule)
_BODIES = (
    (3.8, (0.0, 0.0, 0.09), (0.02, 0.02, 0.01, 0.0, 0.0, 0.0), (0.0, 0.0, 0.05), (0.0, 0.0, 0.14), 0.075),
    (3.6, (0.0, 0.0, 0.15), (0.03, 0.03, 0.01, 0.0, 0.0, 0.0), (0.0, 0.0, 0.04), (0.0, 0.01, 0.21), 0.065),
    (2.7, (0.0, 0.04, 0.1), (0.02, 0.02, 0.004, 0.0, 0.0, -0.0003), (0.0, 0.03, 0.0), (0.0, 0.035, 0.205), 0.062),
    (2.4, (-0.01, 0.0, 0.14), (0.01, 0.01, 0.004, 0.0, -0.001, -0.0007), (0.0, 0.0, 0.03), (-0.02, -0.01, 0.19), 0.058),
    (2.4, (-0.01, 0.03, 0.1), (0.02, 0.02, 3e-3, 0.0, -2e-3, -1e-3), (0.0, 0.025, 0.0), (-0.02, 0.025, 0.195), 0.055),
    (2.3, (0.0, 0.0, 0.14), (0.01, 0.01, 0.004, 0.0, 0.0, 0.001), (0.0, 0.0, 0.03), (0.0, 0.01, 0.19), 0.053),
    (2.2, (0.02, 0.06, 0.07), (0.01, 0.01, 0.004, 0.0, -0.001, 0.002), (0.0, 0.04, 0.0), (0.0, 0.073, 0.11), 0.052),
    (0.8, (0.0, 0.0, 0.03), (0.001, 0.001, 0.001, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.035), 0.045),
)


def _link(name: str, mass_kg: float, com_m: Vec3, inertia: Inertia, start: Vec3, end: Vec3, radius_m: float) -> Link:
    capsule = Capsule(start_m=start, end_m=end, radius_m=radius_m)
    return Link(name=name, mass_kg=mass_kg, com_m=com_m, inertia_kgm2=inertia, capsules=(capsule,))


# (origin m, rpy rad, axis, lower rad, upper rad, velocity rad/s, torque Nm, armature kg m2)
_TABLE = (
    ((0.0, 0.0, 0.155), (0.0, 0.0, -pi), Z, -2.7925, 2.7925, 2.0944, 123.0, 3.17),
    ((0.0, 0.03, 0.21), (0.0, 0.0, 0.0), Y, -2.2689, 2.2689, 2.0944, 123.0, 3.17),
    ((0.0, 0.035, 0.205), (0.0, 0.0, 0.0), Z, -2.9671, 2.9671, 2.4435, 64.0, 1.38),
    ((-0.02, -0.03, 0.19), (0.0, 0.0, -pi), Y, -1.8675, 2.6878, 2.4435, 64.0, 1.38),
    ((-0.02, 0.025, 0.195), (0.0, 0.0, -pi), Z, -2.9671, 2.9671, 4.8869, 39.0, 0.13),
    ((0.0, 0.03, 0.19), (0.0, 0.0, 0.0), Y, -1.3963, 4.5379, 4.8869, 39.0, 0.13),
    ((-0.015, 0.073, 0.11), (0.0, -pi / 2, 0.0), Z, -2.9671, 2.9671, 4.8869, 39.0, 0.13),
)

# A parallel gripper of the Xense kind. Stroke, force, speed, gel window and gel depth are those of the measured
# conditions. Source of the masses, the boxes and the 0.20 m from flange to pads: ours; the hand has 0.884 kg (0.944 kg
# with the probe), and the fingers reach 0.131 m below the body.
XENSE_GRIPPER = Gripper(
    pose_E_P=Pose(np.array([0.0, 0.0, 0.20])),
    mass_kg=0.704,
    com_E_m=(0.0, 0.0, 0.045),
    finger_mass_kg=0.09,
    stroke_m=0.085,
    force_N=60.0,
    speed_m_s=0.35,
    body=(Box(centre_m=(0.0, 0.0, 0.0425), half_m=(0.04, 0.07, 0.0425)),),
    finger=Box(centre_m=(0.0, 0.007, -0.0495), half_m=(0.011, 0.007, 0.0655)),
    pad_window_m=(0.0172, 0.0285),
    pad_shape=(35, 20),
    pad_depth_m=0.0015,
)

RIZON4_XENSE = RobotDescription(
    name="Flexiv Rizon 4 with Xense gripper",
    base=_link("base", *_BODIES[0]),
    joints=tuple(
        Joint(
            name=f"joint{i}",
            origin_m=origin,
            origin_rpy_rad=rpy,
            axis=axis,
            lower_rad=lower,
            upper_rad=upper,
            velocity_rad_s=velocity,
            torque_Nm=torque,
            armature_kgm2=armature,
            link=_link(f"link{i}", *body),
        )
        for i, ((origin, rpy, axis, lower, upper, velocity, torque, armature), body) in enumerate(
            zip(_TABLE, _BODIES[1:], strict=True), start=1
        )
    ),
    # Vendor RDK v1.5 URDF and flexiv_ros2: flange 0.081 m beyond joint 7, turned by -pi about its axis.
    pose_last_E=Pose.planar((0.0, 0.0, 0.081), -pi),
    # P at (0.60, 0, 0.10) m in B, pointing straight down, x_P along -x_B, 44 degrees or more inside every limit (solved
    # from the posture [10, -33, 1, 110, -1, 54, 11] degrees, which reaches a whole container 0.60 m ahead).
    home_q=(0.17344923, -0.56430988, 0.01689796, 1.92008167, -0.01479139, 0.91347779, 0.19943737),
    gripper=XENSE_GRIPPER,
    source="flexiv_description config/Rizon4 (kinematics, inertia), flexiv_rdk v1.5 URDF (ranges, flange), "
    "mujoco_menagerie flexiv_rizon4 (armature)",
)
