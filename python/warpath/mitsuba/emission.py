"""Where the camera may see an emitter directly. What it sees needs no warp and has camera rays of its own."""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np


def pixels_that_may_see(scene: mi.Scene, sensor: mi.Sensor) -> np.ndarray:
    """H x W of the crop window: False where a camera ray sees no emitter for certain.

    Boxes around the emitters are projected; under a sky, through a lens, or where a box reaches behind the camera all pixels may see.
    """
    width, height = np.array(sensor.film().crop_size(), int)
    boxes = [shape.bbox() for shape in scene.shapes() if shape.is_emitter()]
    mask = np.zeros((height, width), bool)
    projection = _projection(sensor)
    if scene.environment() is not None or (boxes and projection is None):
        return np.ones_like(mask)
    for box in boxes:
        low, high = np.array(box.min, float).ravel(), np.array(box.max, float).ravel()
        corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] + [1] for k in range(8)])
        x, y, depth = _project(projection, corners)
        if depth.min() <= 0:
            return np.ones_like(mask)
        # A pixel more on each side, against rounding.
        left, right = math.floor(x.min() * width) - 1, math.ceil(x.max() * width) + 1
        top, bottom = math.floor(y.min() * height) - 1, math.ceil(y.max() * height) + 1
        mask[max(0, top) : max(0, bottom), max(0, left) : max(0, right)] = True
    return mask


def widened(mask: np.ndarray, reach: int) -> np.ndarray:
    """The pixels within `reach` of one of the mask's."""
    for axis in (0, 1):
        padded = np.pad(mask, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)])
        mask = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis).any(-1)
    return mask


def _projection(sensor: mi.Sensor) -> tuple[np.ndarray, np.ndarray] | None:
    """World to camera, and camera to the crop window's [0, 1)^2; None for what is no pinhole camera that stands still."""
    parameters = mi.traverse(sensor)
    needed = ("x_fov", "near_clip", "far_clip")
    if sensor.class_name() != "PerspectiveCamera" or sensor.shutter_open_time() > 0 or not all(name in parameters for name in needed):
        return None
    number = lambda name: float(np.ravel(parameters[name])[0])  # noqa: E731
    if any(number(name) != 0 for name in ("principal_point_offset_x", "principal_point_offset_y") if name in parameters):
        return None
    film = sensor.film()
    fov, near, far = map(number, needed)
    to_film = mi.scalar_rgb.perspective_projection(film.size(), film.crop_size(), film.crop_offset(), fov, near, far)
    to_world = np.array(sensor.world_transform().matrix, float).reshape(4, 4)
    return np.linalg.inv(to_world), np.array(to_film.matrix, float)


def _project(projection: tuple[np.ndarray, np.ndarray], points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    local = points @ projection[0].T
    film = local @ projection[1].T
    with np.errstate(divide="ignore", invalid="ignore"):
        return film[:, 0] / film[:, 3], film[:, 1] / film[:, 3], local[:, 2]
