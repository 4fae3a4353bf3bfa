"""The embedded path tracer: scenes from files of Mitsuba 3, rendered as the command line does."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from .training import Warp, training_options

_MISSING = ("this installation has no renderer: install what packages.txt lists (on Debian 12: ./run does), then "
            "`pip install . -Ccmake.define.WARPATH_RENDERER=ON` in a clone")


def _module():
    try:
        from . import _renderer
    except ImportError as error:
        raise ImportError(f"{_MISSING} ({error})") from error
    return _renderer


class Scene:
    """A scene that is ready to be rendered: what `load_scene` returns.

    Attributes:
        width, height: of the image, in pixels.
        spp: samples per pixel that its file asks for.
        max_depth: longest path, counted as Mitsuba does; -1 for no bound.
        emitters: how many there are.
    """

    def __init__(self, core):
        self._core = core
        self.width: int = core.width
        self.height: int = core.height
        self.spp: int = core.spp
        self.max_depth: int = core.max_depth
        self.emitters: int = core.emitters

    def __repr__(self) -> str:
        return f"Scene({self.width} x {self.height}, {self.emitters} emitters)"


class Image(np.ndarray):
    """A rendered image, H x W x 3, linear RGB, float32: an array that knows how it was made.

    Attributes:
        variance: of each pixel's mean, H x W x 3; None for an array that was made of an image.
        samples: how many fell into each pixel, H x W.
        spp: samples per pixel on average.
        seconds: that it took, training included.
        non_finite: samples that were not finite, and count as 0.
        choice: what `auto` chose, and why.
    """

    variance: np.ndarray | None
    samples: np.ndarray | None
    spp: float
    seconds: float
    non_finite: int
    choice: str

    def __array_finalize__(self, source: Any) -> None:
        self.variance = self.samples = None
        self.spp = self.seconds = 0.0
        self.non_finite, self.choice = 0, ""

    @classmethod
    def _of(cls, rendered) -> Image:
        image = np.asarray(rendered.mean).view(cls)
        image.variance, image.samples = np.asarray(rendered.variance), np.asarray(rendered.samples)
        for name in ("spp", "seconds", "non_finite", "choice"):
            setattr(image, name, getattr(rendered, name))
        return image


def load_scene(file: str | os.PathLike[str], *, size: tuple[int, int] | None = None, max_depth: int | None = None,
               crop: tuple[int, int, int, int] | None = None, **parameters: Any) -> Scene:
    """Loads a scene in Mitsuba 3's XML.

    Args:
        file: its file.
        size: (width, height) of the film, in place of the file's.
        max_depth: longest path, in place of the file's.
        crop: (x, y, width, height) of the part of the film that is rendered.
        parameters: the scene's own, as `-D name=value` on the command line.

    Raises:
        ImportError: where the renderer was not built in; the message says how to.
        OSError: a file that cannot be used, with line and column.
    """
    module = _module()
    options = {"size": _joined("x", size), "crop": _joined(",", crop), "max_depth": max_depth}
    defines = [(name, str(value)) for name, value in parameters.items()]
    return Scene(module.load(os.fspath(file), defines, _texts(options)))


def _joined(separator: str, numbers: Any) -> str | None:
    return None if numbers is None else separator.join(map(str, numbers))


def _texts(options: dict[str, Any]) -> dict[str, str]:
    """Those that were given, as text."""
    return {name: str(value) for name, value in options.items() if value is not None}


def render(scene: Scene, *, spp: int | None = None, warp: str | os.PathLike[str] = "none", time: float | None = None, objective: str = "relmse",
           sampler: str = "independent", seed: int = 0, **options: Any) -> Image:
    """Renders a scene, as `warpath render` does: the same numbers for the same seed.

    Args:
        scene: from `load_scene`.
        spp: samples per pixel; None takes the scene's.
        warp: "none", FAMILY:DIMS (families: uniform, grid, kdtree, realnvp, spline, conditional-kdtree,
            conditional-spline), "field", "auto", or the file of a trained warp.
        time: seconds for everything, in place of spp.
        objective: the error that samples are placed to lessen where the film is stratified: "mse", "relmse" or "even".
        sampler: "independent", "stratified" or "sobol".
        seed: other numbers.
        options: of training, named as on the command line, with _ in place of -.

    Returns:
        The image, H x W x 3, linear RGB, with `variance`, `samples`, `spp` and `seconds`.

    Raises:
        ValueError: a method, name or option that there is not.

    Example:

        >>> import warpath                                                           # doctest: +SKIP
        >>> scene = warpath.load_scene("scenes/study/scene.xml", size=(320, 180))    # doctest: +SKIP
        >>> image = warpath.render(scene, spp=32, warp="kdtree:film+bounce1")        # doctest: +SKIP
        >>> image.shape, image.variance.shape                                        # doctest: +SKIP
        ((180, 320, 3), (180, 320, 3))
    """
    if isinstance(warp, Warp):
        raise ValueError("a Warp that is in memory belongs to the renderer that trained it; save it and pass the file")
    settings = {"spp": spp, "time": time, "objective": objective, "sampler": sampler, "seed": seed}
    return Image._of(_module().render(scene._core, os.fspath(warp), _texts(settings), training_options(options)))
