"""A simulated trial as one message: all from which another process builds its world, the STL files included.

The message names no file and no class, and decoding it runs no code: its parts are numbers, words and STL files, and
each goes through the checks of the class it becomes. The receiver writes the STL files to a folder of its own.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np

from glotouch_backends.options import WorldOptions
from glotouch_bt.robot import BadInput, Conditions, Container, Holder, ObjectSet, Pose, Probe, World, frozen_array
from glotouch_bt.robot.scene import stl_files
from glotouch_bt.untrusted import read_file

MAX_OBJECTS = 200
"""Largest number of objects. Source: ours."""
MAX_MESSAGE_BYTES = 64 * 1024 * 1024
"""Largest message; the shipped objects have 1 MB in all. Source: ours."""

Trial = tuple[World, Conditions, int, WorldOptions]
Three = tuple[float, float, float]
Seven = tuple[float, float, float, float, float, float, float]
Stem = Annotated[str, msgspec.Meta(pattern=r"^[^/\\\0.][^/\\\0]{0,199}\Z")]
"""Name of an object, and of the file that the receiver writes."""


class TrialData(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The message; see `World` and its parts."""

    world: str
    pose_B_K: Seven
    interior_m: Three
    wall_m: float
    probe: Probe
    pose_B_grasp: Seven
    half_m: Three
    stl: Annotated[dict[Stem, bytes], msgspec.Meta(max_length=MAX_OBJECTS)]
    min_gap_m: float
    min_wall_gap_m: float
    touching_share: float
    stance: Literal["upright", "any"]
    lying_share: float | None
    conditions: Conditions
    seed: Annotated[int, msgspec.Meta(ge=0)]
    options: WorldOptions


def pose_numbers(pose: Pose) -> Seven:
    """Return a pose as x y z qw qx qy qz."""
    x, y, z = pose.position_m.tolist()
    return (x, y, z, *pose.quat.tolist())


def pose_of(numbers: tuple[float, ...]) -> Pose:
    """Return the pose of seven numbers to the bit: its quaternion is not normalised a second time.

    Raises:
        ParamError: Not finite, or no unit quaternion.
    """
    pose = Pose(np.array(numbers[:3]), np.array(numbers[3:]))
    object.__setattr__(pose, "quat", frozen_array("quat", numbers[3:], (4,)))
    return pose


def trial_message(world: World, conditions: Conditions, seed: int, options: WorldOptions) -> bytes:
    """Return a trial as a message.

    Raises:
        BadInput: The objects' files cannot be read, or are too large.
    """
    container, holder, objects = world.container, world.holder, world.objects
    data = TrialData(
        world=world.name,
        pose_B_K=pose_numbers(container.pose_B_K),
        interior_m=container.interior_m,
        wall_m=container.wall_m,
        probe=world.probe,
        pose_B_grasp=pose_numbers(holder.pose_B_grasp),
        half_m=holder.half_m,
        stl=_stl_files(objects),
        min_gap_m=objects.min_gap_m,
        min_wall_gap_m=objects.min_wall_gap_m,
        touching_share=objects.touching_share,
        stance=objects.stance,
        lying_share=objects.lying_share,
        conditions=conditions,
        seed=seed,
        options=options,
    )
    message = msgspec.msgpack.encode(data, enc_hook=_plain_number)
    if len(message) > MAX_MESSAGE_BYTES:
        raise _too_large(objects.folder)
    return message


def _plain_number(value: object) -> object:
    """Return a number of numpy as one of Python."""
    if isinstance(value, np.generic):
        return value.item()
    raise BadInput(f"a simulated world cannot hold a {type(value).__name__} ({value!r:.100})")


def _too_large(folder: Path) -> BadInput:
    limit = f"{MAX_MESSAGE_BYTES / 1e6:.0f} MB in {MAX_OBJECTS} files"
    return BadInput(
        f"{folder}: its STL files are more than simulated devices take ({limit}); use fewer or coarser ones"
    )


def _stl_files(objects: ObjectSet) -> dict[str, bytes]:
    """Return the STL files of an object set by name, in its order."""
    found = stl_files(objects.folder)
    names = objects.names or tuple(found)
    missing = [n for n in names if n not in found]
    if missing or not found:
        raise BadInput(
            f"{objects.folder}: has no {', '.join(missing) or '.stl file'} (it has {', '.join(found) or '-'})"
        )
    if len(names) > MAX_OBJECTS or sum(found[n].stat().st_size for n in names) > MAX_MESSAGE_BYTES:
        raise _too_large(objects.folder)
    return {n: read_file(found[n], MAX_MESSAGE_BYTES, what="an STL file", links=True) for n in names}


@contextmanager
def trial_of_message(message: bytes) -> Iterator[Trial]:
    """Yield the trial of a message; the files of its objects exist until the block ends.

    Raises:
        BadInput: The bytes are not such a message, or a value in it is not valid.
    """
    try:
        if len(message) > MAX_MESSAGE_BYTES:
            raise ValueError(f"{len(message)} bytes; at most {MAX_MESSAGE_BYTES} are taken")
        data = msgspec.msgpack.decode(message, type=TrialData)
    except (msgspec.MsgspecError, ValueError, RecursionError, OverflowError) as e:
        raise BadInput(f"the simulated world cannot be read from its message: {e}") from e
    with tempfile.TemporaryDirectory(prefix="glotouch-") as folder:
        objects = ObjectSet(
            folder=Path(folder),
            names=tuple(data.stl),
            min_gap_m=data.min_gap_m,
            min_wall_gap_m=data.min_wall_gap_m,
            touching_share=data.touching_share,
            stance=data.stance,
            lying_share=data.lying_share,
        )
        for name, content in data.stl.items():
            (objects.folder / f"{name}.stl").write_bytes(content)
        world = World(
            name=data.world,
            container=Container(pose_B_K=pose_of(data.pose_B_K), interior_m=data.interior_m, wall_m=data.wall_m),
            probe=data.probe,
            holder=Holder(pose_B_grasp=pose_of(data.pose_B_grasp), half_m=data.half_m),
            objects=objects,
        )
        yield world, data.conditions, data.seed, data.options
