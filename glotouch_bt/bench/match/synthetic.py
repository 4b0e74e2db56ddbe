"""TouchSets of standing objects: traced, touched on top and squeezed in the fixed scheme, without a robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from glotouch_bt.bench.match.dataset import Layout, Touched
from glotouch_bt.perception.recognition.model import TIP_RADIUS_M, traced_tips
from glotouch_bt.perception.touch import (
    Candidate,
    Contour,
    Layer,
    TouchSequence,
    TouchSet,
    fit_contour,
    pad_noise_m,
    relief_of_images,
)
from glotouch_bt.robot import Array, BadInput, Conditions, World, load_backend
from glotouch_bt.robot.scene import stl_files, stream
from glotouch_bt.robot.simulation import Place, TouchSampler

FORCE_N = 10.0
"""Closing force. Source: `ClosureParams`."""
LOWEST_M, TOP_OVERLAP_M, LAYERS = 0.021, 0.008, 4
"""Least height of the pads, distance of the highest below the top, closures a sequence. Source: `ClosureParams`."""
CONTACTS = 12
"""Contacts of a trace. Source: ours."""
CONTACT_SD_M, HEIGHT_SD_M = 3e-4, 5e-4
"""Errors of a contact and of a top besides those of the conditions. Source: ours."""
DRIFT_M, DRIFT_RAD = 1.5e-3, math.radians(3.0)
"""Motion of the object between two sequences. Source: ours."""


BOX = 5
"""Largest number of objects that a sampler places in one box."""
HANDLED_SEED = 1_000_000
"""Added to a layout's seed: an object is handled in another trial, with other errors, than it is recognised in."""
MAX_CLOSURES = 20
"""Largest number of closures of one handling. Source: `RememberParams`."""


def sampled_layout(backend: str, world: World, conditions: Conditions, seed: int, *, images: bool = False) -> Layout:
    """Touch every object of a trial as `sample_layout` does.

    Raises:
        BadInput: The backend has no `TouchSampler`, or the objects cannot be used.
    """
    boxes = [
        sample_layout(sampler, seed, conditions.name, k * BOX, images=images)
        for k, sampler in enumerate(samplers(backend, world, conditions, seed))
    ]
    names = tuple(name for box in boxes for name in box.objects)
    return Layout(seed, conditions.name, names, tuple(t for box in boxes for t in box.touched))


def samplers(backend: str, world: World, conditions: Conditions, seed: int) -> list[TouchSampler]:
    """Return samplers for all objects of a world, at most `BOX` objects each; all have the same sensors.

    Objects that are touched without a robot are touched one by one, so they need not fit into one box.

    Raises:
        BadInput: See `sampled_layout`.
    """
    names = world.objects.names or tuple(stl_files(world.objects.folder))
    out = []
    for first in range(0, len(names), BOX):
        some = replace(world, objects=replace(world.objects, names=names[first : first + BOX]))
        sampler = load_backend(backend).touch_sampler(some, conditions, seed)
        if sampler is None:
            raise BadInput(f"--backend {backend}: cannot touch objects without a robot")
        out.append(sampler)
    return out


def sample_layout(sampler: TouchSampler, seed: int, conditions: str, first: int = 0, *, images: bool = False) -> Layout:
    """Touch every object once; equal seeds draw equal stances whatever the conditions.

    Candidates are numbered from `first`. `images` takes gel images with every closure, too.
    """
    touched = []
    for index, name in enumerate(sampler.names, first):
        rng = stream(seed, f"stances {name}")
        touchset, place = _touch(sampler, name, index, rng, images)
        touched.append(Touched(touchset, name, place, 0.0))
    return Layout(seed, conditions, sampler.names, tuple(touched))


def handled_objects(backend: str, world: World, conditions: Conditions, seed: int) -> dict[str, TouchSet]:
    """Handle every object alone, as the mission `remember` does, in a trial of its own.

    Raises:
        BadInput: See `sampled_layout`.
    """
    seed += HANDLED_SEED
    return {
        name: _touch(sampler, name, 0, stream(seed, f"handling {name}"), False, True)[0]
        for sampler in samplers(backend, world, conditions, seed)
        for name in sampler.names
    }


def _touch(
    sampler: TouchSampler, name: str, index: int, rng: np.random.Generator, images: bool, alone: bool = False
) -> tuple[TouchSet, Place]:
    solid = sampler.solid(name).as_trimesh()
    place: Place = (*rng.uniform(-0.05, 0.05, 2).tolist(), float(rng.uniform(-math.pi, math.pi)))
    top_m = float(np.asarray(solid.vertices)[:, 2].max()) + HEIGHT_SD_M * float(rng.standard_normal())
    aim = np.asarray(solid.bounds)[:, :2].mean(axis=0) + 3e-3 * rng.standard_normal(2)
    tips = traced_tips(solid, aim, CONTACTS, float(rng.uniform(0.0, 2 * math.pi)))
    approach = (aim - tips) / np.linalg.norm(aim - tips, axis=1, keepdims=True)
    c, s = math.cos(place[2]), math.sin(place[2])
    turn = np.array([[c, -s], [s, c]])
    tips_K = tips @ turn.T + np.array(place[:2]) + CONTACT_SD_M * rng.standard_normal(tips.shape)
    contour = fit_contour(tips_K + sampler.probe_errors_m(approach @ turn.T), TIP_RADIUS_M)
    candidate = Candidate(index, contour, top_m, 1.0, ())
    heights = np.linspace(LOWEST_M, max(top_m - TOP_OVERLAP_M, LOWEST_M), LAYERS)
    if heights[-1] - heights[0] < 0.003:
        heights = heights[:1]
    sequences = []
    stances = _handling(contour, rng, MAX_CLOSURES // len(heights)) if alone else _stances(contour, rng)
    for stance in stances:
        drift = rng.standard_normal(3) * [DRIFT_M, DRIFT_M, DRIFT_RAD]
        place = (place[0] + drift[0], place[1] + drift[1], place[2] + drift[2])
        layers = []
        for height in heights:
            layer, place = _close(sampler, name, place, stance, float(height), images)
            layers.append(layer)
        sequences.append(TouchSequence(np.array(stance[:2]), stance[2], tuple(layers)))
    return TouchSet(candidate, tuple(sequences)), place


def _stances(contour: Contour, rng: np.random.Generator) -> list[Place]:
    """Return the hand's places of the fixed scheme: three directions of a round object, three tracks of a box."""
    x, y = contour.centre_K_m.tolist()
    if contour.kind == "round":
        first = float(rng.uniform(0.0, math.pi))
        return [(x, y, first + k * math.pi / 3) for k in range(3)]
    along = np.array([math.cos(contour.yaw_rad), math.sin(contour.yaw_rad)])
    return [
        (x + k * contour.size_m[0] * along[0], y + k * contour.size_m[0] * along[1], contour.yaw_rad)
        for k in (-0.25, 0.0, 0.25)
    ]


def _handling(contour: Contour, rng: np.random.Generator, count: int) -> list[Place]:
    """Return the hand's places of `remember`, at most `count`.

    A round object is squeezed from all sides, a box on its three tracks and then from other sides.
    """
    x, y = contour.centre_K_m.tolist()
    tracks = [] if contour.kind == "round" else _stances(contour, rng)
    first = float(rng.uniform(0.0, math.pi)) if contour.kind == "round" else contour.yaw_rad + 0.5 * math.pi
    more = count - len(tracks)
    turned = [(x, y, first + k * math.pi / (more + bool(tracks))) for k in range(more)]
    return tracks + turned


def _close(
    sampler: TouchSampler, name: str, place: Place, hand: Place, height_m: float, images: bool
) -> tuple[Layer, Place]:
    free, untouched = sampler.untouched(), sampler.untouched_images() if images else None
    done = sampler.close(name, place, hand, height_m, FORCE_N, images=images)
    position: Array = np.array(hand[:2])
    if done is None:
        empty = np.zeros_like(free.left_m)
        return Layer(height_m, 0.0, position, hand[2], empty, empty, 0.0, False, "jaws met"), place
    left, right, noise = done.frame.left_m, done.frame.right_m, pad_noise_m([free])
    relief = None
    if done.images is not None and untouched is not None:
        relief = relief_of_images(done.images, untouched, sampler.gripper)
    layer = Layer(
        height_m, done.aperture_m, position, hand[2], left, right, FORCE_N, True, noise_m=noise, relief=relief
    )
    return layer, done.place
