"""Relief from images against closed forms; the images are made here, not by the simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_bt.perception.touch import BLOCKS, relief_of_images, relief_of_surface
from glotouch_bt.perception.touch.squeeze.relief import RESOLVED_M, SHAPE_M, slopes_of_image
from glotouch_bt.robot import Array, GelCamera, GelImages, ParamError

CAMERA = XENSE_GRIPPER.camera
assert CAMERA is not None
PITCH_M = XENSE_GRIPPER.image_pitch_m
ROWS, COLUMNS = CAMERA.shape


def shown(slope_rows: Array, slope_columns: Array, gain: Array, *, right: bool) -> Array:
    """Brightness (rows, columns, 3) of a matt surface with given slopes under the camera's lights."""
    normal = np.stack([-slope_columns, -slope_rows, np.ones_like(slope_rows)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.maximum(normal @ CAMERA.directions(right=right).T, 0.0) * gain


@pytest.mark.parametrize("right", [False, True])
def test_slopes_come_back_whatever_the_brightness_of_the_lights(right: bool) -> None:
    rng = np.random.default_rng(4)
    slopes = rng.uniform(-0.6, 0.6, (2, ROWS, COLUMNS))
    gain = np.array([80.0, 110.0, 95.0])
    flat = shown(np.zeros((ROWS, COLUMNS)), np.zeros((ROWS, COLUMNS)), gain, right=right)
    image = shown(slopes[0], slopes[1], gain, right=right)
    found = slopes_of_image(image, flat, CAMERA.directions(right=right))  # type: ignore[arg-type]
    assert np.abs(found - slopes).max() < 1e-9


@pytest.mark.parametrize("wavelength_m", [2e-3, 4e-3])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_wave_has_the_relief_of_its_closed_form(wavelength_m: float, axis: int) -> None:
    """A wave of amplitude A and wave number k: A k / sqrt(2) times the difference of two Gaussians' responses."""
    k, amplitude = 2 * np.pi / wavelength_m, 1e-4
    place = np.arange((ROWS, COLUMNS)[axis]) * PITCH_M[axis]
    wave = amplitude * np.sin(k * place)
    height = np.broadcast_to(wave[:, None] if axis == 0 else wave[None], (ROWS, COLUMNS))
    found = relief_of_surface(height, PITCH_M)
    response = np.exp(-0.5 * (k * RESOLVED_M) ** 2) - np.exp(-0.5 * (k * SHAPE_M) ** 2)
    assert found.shape == (2, *BLOCKS)
    assert found[axis, 1:-1, 1:-1].mean() == pytest.approx(amplitude * k / np.sqrt(2) * response, rel=0.05)
    assert found[1 - axis].max() < 1e-12


def pixels(image: Array) -> Array:
    return np.rint(image).astype(np.uint8)  # type: ignore[return-value]


def test_images_and_surface_have_the_same_relief_and_noise_adds_none() -> None:
    rng = np.random.default_rng(1)
    y = np.arange(ROWS) * PITCH_M[0]
    height = np.broadcast_to(1e-4 * np.sin(2 * np.pi / 3e-3 * y)[:, None], (ROWS, COLUMNS)).copy()
    slope = np.gradient(height, PITCH_M[0], axis=0)
    flat = np.zeros_like(slope)
    gain = np.array([100.0, 120.0, 110.0])

    def photo(slopes: Array, right: bool) -> Array:
        return pixels(shown(slopes, flat, gain, right=right) + 2.5 * rng.standard_normal((ROWS, COLUMNS, 3)))

    free = GelImages(0.0, photo(flat, False), photo(flat, True))  # type: ignore[arg-type]
    pressed = GelImages(1.0, photo(slope, False), photo(flat, True))  # type: ignore[arg-type]
    left, right = relief_of_images(pressed, free, XENSE_GRIPPER)
    expected = relief_of_surface(height, PITCH_M)
    assert np.abs(left[0] - expected[0]).max() < 0.05 * expected[0].mean()
    assert max(left[1].mean(), right.mean()) < 0.05 * expected[0].mean()


def test_images_of_another_gripper_are_refused() -> None:
    small = GelImages(0.0, np.zeros((21, 10, 3), np.uint8), np.zeros((21, 10, 3), np.uint8))
    with pytest.raises(ParamError, match="images"):
        relief_of_images(small, small, XENSE_GRIPPER)
    with pytest.raises(ParamError, match="camera"):
        relief_of_images(small, small, replace(XENSE_GRIPPER, camera=None))


def test_lights_in_one_plane_are_refused() -> None:
    with pytest.raises(ParamError, match="lights"):
        GelCamera(shape=(14, 10), lights=((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.7, 0.0, 0.7)))
