"""The channels of a record and the schemas of their messages. docs/reference/record.md has them as a table.

Messages with a `foxglove.` name follow the Foxglove schemas (docs.foxglove.dev/docs/sdk/schemas), JSON encoding.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from glotouch_bt.mission.record.mcap_packing import PACKED_DESCRIPTOR, PACKED_NAME

_NUMBER = {"type": "number"}
_STRING = {"type": "string"}
_ANY: dict[str, object] = {}


def _object(**properties: object) -> dict[str, object]:
    return {"type": "object", "properties": properties}


def _array(items: object) -> dict[str, object]:
    return {"type": "array", "items": items}


_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"}) | {"title": "time"}
_DURATION = _object(sec={"type": "integer"}, nsec={"type": "integer"}) | {"title": "duration"}
_VECTOR3 = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER) | {"title": "foxglove.Vector3"}
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER) | {"title": "foxglove.Quaternion"}
_POSE = _object(position=_VECTOR3, orientation=_QUATERNION) | {"title": "foxglove.Pose"}
_COLOR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER) | {"title": "foxglove.Color"}

SCHEMAS: dict[str, dict[str, object]] = {
    "glotouch.Wrench": _object(timestamp=_TIME, frame_id=_STRING, force=_VECTOR3, torque=_VECTOR3, force_N=_NUMBER),
    "glotouch.Gripper": _object(timestamp=_TIME, aperture_m=_NUMBER, force_N=_NUMBER, moving=_NUMBER),
    "glotouch.Tick": _object(timestamp=_TIME, node=_STRING, old=_STRING, new=_STRING),
    "glotouch.Event": _object(timestamp=_TIME, kind=_STRING, data=_object()),
    "glotouch.Port": _object(timestamp=_TIME, key=_STRING, value=_ANY),
    "foxglove.Log": _object(
        timestamp=_TIME,
        level={"type": "integer"},
        message=_STRING,
        name=_STRING,
        file=_STRING,
        line={"type": "integer"},
    ),
    "foxglove.PoseInFrame": _object(timestamp=_TIME, frame_id=_STRING, pose=_POSE),
    "foxglove.FrameTransforms": _object(
        transforms=_array(
            _object(
                timestamp=_TIME,
                parent_frame_id=_STRING,
                child_frame_id=_STRING,
                translation=_VECTOR3,
                rotation=_QUATERNION,
            )
        )
    ),
    "foxglove.JointStates": _object(
        timestamp=_TIME, joints=_array(_object(name=_STRING, position=_NUMBER, velocity=_NUMBER, effort=_NUMBER))
    ),
    "foxglove.RawImage": _object(
        timestamp=_TIME,
        frame_id=_STRING,
        width={"type": "integer"},
        height={"type": "integer"},
        encoding=_STRING,
        step={"type": "integer"},
        data={"type": "string", "contentEncoding": "base64"},
    ),
    "foxglove.SceneUpdate": _object(
        deletions=_array(_object(timestamp=_TIME, type={"type": "integer"}, id=_STRING)),
        entities=_array(
            _object(
                timestamp=_TIME,
                frame_id=_STRING,
                id=_STRING,
                lifetime=_DURATION,
                frame_locked={"type": "boolean"},
                metadata=_array(_object(key=_STRING, value=_STRING)),
                arrows=_array(_object()),
                cubes=_array(_object(pose=_POSE, size=_VECTOR3, color=_COLOR)),
                spheres=_array(_object(pose=_POSE, size=_VECTOR3, color=_COLOR)),
                cylinders=_array(
                    _object(pose=_POSE, size=_VECTOR3, bottom_scale=_NUMBER, top_scale=_NUMBER, color=_COLOR)
                ),
                lines=_array(
                    _object(
                        type={"type": "integer"},
                        pose=_POSE,
                        thickness=_NUMBER,
                        scale_invariant={"type": "boolean"},
                        points=_array(_VECTOR3),
                        color=_COLOR,
                        colors=_array(_COLOR),
                        indices=_array({"type": "integer"}),
                    )
                ),
                triangles=_array(_object()),
                texts=_array(
                    _object(
                        pose=_POSE,
                        billboard={"type": "boolean"},
                        font_size=_NUMBER,
                        scale_invariant={"type": "boolean"},
                        color=_COLOR,
                        text=_STRING,
                    )
                ),
                models=_array(_object()),
            )
        ),
    ),
}

CHANNELS: Mapping[str, str] = {
    "/wrench": "glotouch.Wrench",
    "/pose": "foxglove.PoseInFrame",
    "/tf": "foxglove.FrameTransforms",
    "/joints": "foxglove.JointStates",
    "/gripper": "glotouch.Gripper",
    "/tactile/left": "foxglove.RawImage",
    "/tactile/right": "foxglove.RawImage",
    "/tree/ticks": "glotouch.Tick",
    "/tree/ports": "glotouch.Port",
    "/scene": "foxglove.SceneUpdate",
    "/scene/world": "foxglove.SceneUpdate",
    "/log": "foxglove.Log",
    "/packed/samples": PACKED_NAME,
    "/packed/cycles": PACKED_NAME,
    "/packed/tactile": PACKED_NAME,
    "/packed/images": PACKED_NAME,
    "/packed/image_requests": PACKED_NAME,
}
EVENT_PREFIX = "/events/"


@dataclass(frozen=True)
class Schema:
    """One schema as MCAP stores it, and the encoding of its messages."""

    name: str
    encoding: str
    data: bytes
    message_encoding: str


def schema_of(topic: str) -> Schema:
    """Return the schema of a topic's messages; a topic that is not in `CHANNELS` carries events."""
    name = CHANNELS.get(topic, "glotouch.Event")
    if name == PACKED_NAME:
        return Schema(name, "protobuf", PACKED_DESCRIPTOR, "protobuf")
    text = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": name} | SCHEMAS[name]
    return Schema(name, "jsonschema", json.dumps(text, separators=(",", ":")).encode(), "json")
