"""Rendering a scene of Mitsuba with warped numbers."""

from __future__ import annotations

import math
import os
import warnings
from typing import Any

import mitsuba as mi
import numpy as np

from .. import _core
from ..training import Candidates, Layout, Warp, training_options
from ..training import train as fit
from .black_box import BlackBox
from .emission import widened
from .film import Film

# Samples in one wavefront: enough to keep all cores at work, few enough for memory.
_WAVEFRONT = 2**21
# Camera rays for directly seen emission, for each sample: its edges would else be most of the noise.
_EMISSION_RAYS = 4


def render(scene: mi.Scene, spp: int = 0, warp: str | os.PathLike[str] | Warp = "kdtree:film+bounce1", *, sensor: int | mi.Sensor = 0,
           integrator: mi.SamplingIntegrator | None = None, seed: int = 0, **options: Any) -> mi.TensorXf:
    """Renders a scene with its own integrator, whose random numbers are warped.

    Args:
        scene: as `mitsuba.load_file` gives it.
        spp: samples per pixel; 0 takes the sensor's. Training comes on top.
        warp: "none"; FAMILY:DIMS with a family of uniform, grid, kdtree, realnvp and spline, which is trained first; or a trained warp
            or its file. DIMS are the names that the command line has, but `bounceK.light_uv` means both the choice of light and the
            position on it, because Mitsuba draws both from the same two numbers.
        sensor: the scene's, by its number, or another one.
        integrator: `path`, `direct` or `volpath`; None takes the scene's.
        seed: other numbers.
        options: of training, as `warpath.train` has them.

    Returns:
        The image, H x W x 3, linear RGB. Its expectation is that of `mitsuba.render`. With `film` among DIMS samples fall where the
        warp puts them; else every pixel has its own. What the camera sees emitted directly is estimated apart.

    Raises:
        ValueError: a warp, name or option that there is not.

        >>> import mitsuba as mi                                             # doctest: +SKIP
        >>> mi.set_variant("llvm_ad_rgb")                                    # doctest: +SKIP
        >>> import warpath.mitsuba                                           # doctest: +SKIP
        >>> scene = mi.load_dict(mi.cornell_box())                           # doctest: +SKIP
        >>> image = warpath.mitsuba.render(scene, spp=64, warp="kdtree:film+bounce1", epp=1)    # doctest: +SKIP
    """
    sensor, integrator = _parts(scene, sensor, integrator)
    spp = spp or sensor.sampler().sample_count()
    trained, layout = _prepare(scene, sensor, integrator, warp, seed, options)
    box = BlackBox(scene, sensor, integrator, layout)
    joint = "film" in (group.name for group in layout.groups) if layout else False
    film = Film(sensor.film(), expected=joint)
    pixels = film.width * film.height
    random = np.random.Generator(np.random.Philox(seed))
    done, bad = 0, 0
    for size in _passes(spp, pixels):
        count, first = size * pixels, done * pixels
        if trained:
            y, inv_q = trained.draw(first, count, seed, stratified=joint)
        else:
            y, inv_q = np.empty((0, count), np.float32), None
        place = None if joint else _in_each_pixel(random, np.arange(pixels), size, film.width, film.height)
        if joint:
            order = _coherent(y, layout)
            y, inv_q = y[:, order], inv_q[order]
        position, value, non_finite = box.evaluate(y, _stream(seed, done, 0), place)
        film.add(position, value if inv_q is None else value * _array(inv_q))
        done += size
        bad += non_finite
    if bad:
        warnings.warn(f"{bad} of {done * pixels} samples were not finite; they count as 0", RuntimeWarning, stacklevel=2)
    return mi.TensorXf((film.develop() + _emission(box, sensor, spp, seed, random)).astype(np.float32))


def train(scene: mi.Scene, warp: str = "kdtree:film+bounce1", *, sensor: int | mi.Sensor = 0, integrator: mi.SamplingIntegrator | None = None,
          seed: int = 0, init: Warp | None = None, **options: Any) -> Warp:
    """Trains a warp for a scene: FAMILY:DIMS. `save` writes it as a file for later renders. See `render` for the arguments."""
    sensor, integrator = _parts(scene, sensor, integrator)
    family, layout = _parse(warp)
    if layout is None or family == "uniform":
        raise ValueError(f'"{warp}": there is nothing to train')
    training = training_options(options)
    training.check_used(family)
    count = training.candidate_count()
    candidates = Candidates(layout.name, count, seed)
    box = BlackBox(scene, sensor, integrator, layout)
    for first in range(0, count, _WAVEFRONT):
        size = min(_WAVEFRONT, count - first)
        y, target = candidates.primary_samples(first, size), np.empty(size, np.float32)
        order = _coherent(y, layout)
        _, value, _ = box.evaluate(y[:, order], _stream(seed, first, 1))
        target[order] = np.abs(_luminance(np.array(value, np.float32)))
        candidates.tell(first, target)
    return fit(candidates, family, init=init, seed=seed, **options)


def _parts(scene, sensor, integrator):
    variant = mi.variant() or ""
    if not variant.endswith("_rgb"):
        raise ValueError(f'warpath.mitsuba needs a variant for RGB, such as llvm_ad_rgb; "{variant}" is set')
    sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
    integrator = integrator or scene.integrator()
    if not isinstance(integrator, mi.SamplingIntegrator):
        raise ValueError(f"the integrator is a {type(integrator).__name__}, which does not sample rays")
    return sensor, integrator


def _parse(warp: str) -> tuple[str, Layout | None]:
    family, _, dims = warp.partition(":")
    known = ["none", *_core.families(joint=True)]
    if family not in known:
        raise ValueError(f'unknown warp "{warp}", neither a file nor one of {", ".join(known)}')
    if family == "none":
        if dims:
            raise ValueError(f'"{warp}": none has no dimensions; uniform:{dims} draws those at random')
        return family, None
    return family, Layout(dims or "film+bounce1")


def _prepare(scene, sensor, integrator, warp, seed, options) -> tuple[Warp | None, Layout | None]:
    """The warp that draws, and what it warps; None and an empty choice for none."""
    if not isinstance(warp, Warp) and os.path.exists(warp):
        warp = Warp.load(warp)
    if isinstance(warp, Warp):
        training_options(options).check_used("none")
        return warp, warp.layout
    family, layout = _parse(os.fspath(warp))
    if layout is None:
        training_options(options).check_used(family)
        return None, None
    if family == "uniform":
        return fit(Candidates(layout.name, 1), "uniform", **options), layout
    return train(scene, f"{family}:{layout.name}", sensor=sensor, integrator=integrator, seed=seed, **options), layout


def _passes(spp: int, pixels: int) -> list[int]:
    """Samples per pixel of passes that are about equal, each a wavefront."""
    count = max(1, math.ceil(spp * pixels / _WAVEFRONT))
    count = min(count, spp)
    return [spp * (k + 1) // count - spp * k // count for k in range(count)]


def _coherent(y: np.ndarray, layout: Layout) -> np.ndarray:
    """An order of samples in which neighbours on the film stand together, so that their rays run through the same parts of the scene."""
    if not any(group.name == "film" for group in layout.groups):
        return np.arange(y.shape[1])
    x, y = (y[i] * 256 for i in range(2))  # film comes first in every layout
    return np.argsort(y.astype(np.uint16) << 8 | x.astype(np.uint16), kind="stable")


def _stream(seed: int, first: int, what: int) -> int:
    """A seed for Mitsuba's numbers of its own for every wavefront."""
    return int(np.random.SeedSequence((seed, first, what)).generate_state(1)[0])


def _array(values: np.ndarray):
    return values if mi.variant().startswith("scalar") else mi.Float(values)


def _luminance(rgb: np.ndarray) -> np.ndarray:
    return rgb[0] * 0.212671 + rgb[1] * 0.715160 + rgb[2] * 0.072169


def _in_each_pixel(random: np.random.Generator, pixels: np.ndarray, count: int, width: int, height: int) -> np.ndarray:
    """2 x N film positions in [0, 1): `count` at random in each pixel."""
    return _on_film(np.repeat(pixels, count), random.random((2, len(pixels) * count), np.float32), width, height)


def _on_film(pixels: np.ndarray, offset: np.ndarray, width: int, height: int) -> np.ndarray:
    y, x = np.divmod(pixels, width)
    place = np.stack([x, y]).astype(np.float32)
    # Rounding must not carry a position into the next pixel.
    offset = np.minimum(place + offset, np.nextafter(place + 1, np.float32(0)))
    return np.minimum(offset / np.array([[width], [height]], np.float32), np.float32(1 - 2**-24))


def _emission(box: BlackBox, sensor: mi.Sensor, spp: int, seed: int, random: np.random.Generator) -> np.ndarray:
    """What the camera sees directly: a jittered grid of rays in each pixel whose filter may reach an emitter."""
    film = Film(sensor.film(), expected=False)
    if not box.may_see.any():
        return np.zeros((film.height, film.width, 3))
    # A pixel gets light from a radius around it, and all of the samples there must be known.
    pixels = np.flatnonzero(widened(box.may_see, math.ceil(2 * sensor.film().rfilter().radius())))
    nx = math.ceil(math.sqrt(_EMISSION_RAYS * spp))
    ny = math.ceil(_EMISSION_RAYS * spp / nx)
    cells = np.stack(np.meshgrid(np.arange(nx), np.arange(ny))).reshape(2, -1).astype(np.float32)
    at_once = max(1, _WAVEFRONT // cells.shape[1])
    for first in range(0, len(pixels), at_once):
        some = pixels[first : first + at_once]
        offset = (np.tile(cells, len(some)) + random.random((2, len(some) * cells.shape[1]), np.float32)) / np.array([[nx], [ny]], np.float32)
        place = _on_film(np.repeat(some, cells.shape[1]), offset, film.width, film.height)
        film.add(*box.emission(place, _stream(seed, first, 2)))
    return film.develop()
