"""The factory of robots behind the vendors' interfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from glotouch_backends.flexiv_xense.client.link import OPEN_S, DriverLink
from glotouch_backends.flexiv_xense.client.options import SIMULATED_ONLY, ClientOptions, read_options
from glotouch_backends.flexiv_xense.client.process import DriverProcess
from glotouch_backends.flexiv_xense.client.referee import RemoteReferee
from glotouch_backends.flexiv_xense.client.robot import FlexivXenseRobot
from glotouch_backends.flexiv_xense.driver import messages
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_backends.trial_message import trial_message
from glotouch_bt.robot import Backend, Conditions, Limits, Pose, Robot, RobotDescription, World
from glotouch_bt.robot.simulation import Referee

PERIOD_S = 0.01


def _pose(pose: Pose) -> tuple[float, ...]:
    return (*pose.position_m.tolist(), *pose.quat.tolist())


def _tool(description: RobotDescription) -> messages.ToolData:
    """Return the bare hand: gripper body and both fingers."""
    g = description.gripper
    mass, com = g.mass_and_com_E()
    return messages.ToolData(mass_kg=mass, com_E_m=tuple(com.tolist()), pose_E_P=_pose(g.pose_E_P))


def _arm_limits(description: RobotDescription, limits: Limits) -> messages.ArmLimits:
    joints = description.joints
    return messages.ArmLimits(
        q_min=tuple(j.lower_rad for j in joints),
        q_max=tuple(j.upper_rad for j in joints),
        dq_max=tuple(j.velocity_rad_s for j in joints),
        speed_m_s=limits.tcp_speed_m_s,
        acceleration_m_s2=limits.tcp_acceleration_m_s2,
        stop_acceleration_m_s2=limits.stop_acceleration_m_s2,
        force_N=limits.stop_force_N,
        torque_Nm=limits.stop_torque_Nm,
        max_age_s=limits.max_age_s,
    )


def _within(description: RobotDescription, opened: messages.Opened) -> RobotDescription:
    """Return the description with the device's joint ranges where those are narrower."""
    joints = tuple(
        replace(j, lower_rad=max(j.lower_rad, low), upper_rad=min(j.upper_rad, high))
        for j, low, high in zip(description.joints, opened.q_min, opened.q_max, strict=True)
    )
    return replace(description, joints=joints)


class FlexivXenseBackend(Backend):
    """A Flexiv Rizon arm with a Xense gripper and tactile sensors, or simulated ones that speak the same interfaces.

    Args:
        description: The robot.
        limits: Hard limits to enforce.
    """

    name = "flexiv_xense"
    summary = "Flexiv Rizon 4 and Xense gripper through the vendors' SDKs, or simulated (--set devices=simulated)"

    def __init__(self, description: RobotDescription = RIZON4_XENSE, limits: Limits | None = None) -> None:
        self.description: RobotDescription = description
        self._limits = limits or Limits()

    def open(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> Robot:
        """See `Backend`; options in `ClientOptions` and `DeviceSettings`; conditions and seed for simulated devices."""
        return self.connect(world, conditions, seed, *read_options(options))

    def look(self, world: World, conditions: Conditions, options: Mapping[str, object]) -> Robot:
        """Connect without enabling, switching or commanding anything, for `glotouch doctor`."""
        return self.connect(world, conditions, 0, *read_options(options), move=False)

    def is_real(self, options: Mapping[str, object]) -> bool:
        """Return True if the options select a real arm."""
        return read_options(options)[0].devices == "real"

    def connect(
        self,
        world: World,
        conditions: Conditions,
        seed: int,
        options: ClientOptions,
        settings: messages.DeviceSettings,
        *,
        move: bool = True,
    ) -> FlexivXenseRobot:
        """Open a robot with converted options; enable nothing if `move` is False."""
        trial = b"" if options.devices == "real" else trial_message(world, conditions, seed, options.world)
        process = None if options.driver else DriverProcess(options)
        link: DriverLink | None = None
        try:
            if process is not None:
                process.start(trial)
            link = DriverLink(
                options.driver or (process.address if process else ""),
                (lambda: None) if process is None else process.gone,
                paced=not options.lockstep,
                keys=Path(options.keys) if options.keys else None,
            )
            request = self._request(options, settings, trial if options.lockstep else b"", link.number(), move)
            opened = link.ask(request, messages.Opened, limit_s=OPEN_S, on_progress=lambda _: None)
            link.beat()
            first = link.wait(0, messages.Block, limit_s=10.0)
        except BaseException:
            if link is not None:
                link.close()
            if process is not None:
                process.end()
            raise
        description = _within(self.description, opened)
        robot = FlexivXenseRobot(description, self._limits, PERIOD_S, link, process, opened.info, first)
        robot.paced = not options.lockstep
        return robot

    def _request(
        self, options: ClientOptions, settings: messages.DeviceSettings, world: bytes, number: int, move: bool
    ) -> messages.Open:
        hand = self.description.gripper
        return messages.Open(
            number=number,
            protocol=messages.PROTOCOL,
            devices=messages.Devices(kind=options.devices, settings=settings, world=world),
            tool=_tool(self.description),
            arm=_arm_limits(self.description, self._limits),
            hand=messages.HandLimits(
                stroke_m=hand.stroke_m,
                speed_m_s=hand.speed_m_s,
                force_N=hand.force_N,
                pad_shape=hand.pad_shape,
                pad_depth_m=hand.pad_depth_m,
                image_shape=None if hand.camera is None else hand.camera.shape,
            ),
            posture=self.description.home_q,
            period_s=PERIOD_S,
            lockstep=options.lockstep,
            move=move,
        )

    def is_portable(self, option: str, value: object) -> bool:
        """See `Backend`: the options of simulated devices, and that the devices are simulated."""
        return option in SIMULATED_ONLY or (option, value) == ("devices", "simulated")

    def referee(self, robot: Robot) -> Referee | None:
        """See `Backend`; None for real devices."""
        if isinstance(robot, FlexivXenseRobot) and robot.info["devices"] != "real":
            return RemoteReferee(robot.link)
        return None
