"""Training on candidates that any renderer evaluates, and the warps that come of it."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from . import _core


class Group(NamedTuple):
    """Numbers of a path that are drawn together."""

    name: str  #: "film", "bounce1.dir", ...
    kind: str  #: "film", "lens", "time", "light", "light_uv", "lobe", "dir" or "rr"
    bounce: int  #: 0 for film, lens and time; else the vertex, counted from 1
    size: int  #: how many numbers


class Layout:
    """Which numbers of a path are warped: `film+bounce1+bounce2.light_uv`, in the order in which a path uses them.

        >>> import warpath
        >>> layout = warpath.Layout("bounce1+film")
        >>> layout.name, layout.dims
        ('film+bounce1.dir', 4)
    """

    def __init__(self, names: str):
        self._core = _core.Layout(names)

    @property
    def name(self) -> str:
        return self._core.name

    @property
    def dims(self) -> int:
        """D, how many numbers those are."""
        return self._core.dims

    @property
    def groups(self) -> list[Group]:
        """In the order of the columns of y."""
        return [Group(*group) for group in self._core.groups]

    def __repr__(self) -> str:
        return f"Layout({self.name!r})"


class Candidates:
    """Uniform primary samples: asked for with `primary_samples`, told what they are worth with `tell`.

    Each takes 4 bytes, as only its target is kept.

    Args:
        layout: the names of the numbers that are to be warped.
        count: how many there are.
        seed: another seed, other samples.
    """

    def __init__(self, layout: str, count: int, seed: int = 0):
        self._core = _core.Candidates(layout, count, seed)

    def __len__(self) -> int:
        return self._core.count

    @property
    def non_finite(self) -> int:
        """Targets that were negative, infinite or NaN, and count as 0."""
        return self._core.non_finite

    def primary_samples(self, first: int, count: int) -> np.ndarray:
        """D x `count` numbers in [0, 1), float32: a row for each number of the layout, a column for each candidate from `first` on."""
        y = np.empty((self._core.layout.dims, count), np.float32)
        self._core.primary_samples(first, y)
        return y

    def tell(self, first: int, target: np.ndarray) -> None:
        """The targets g >= 0 of the candidates from `first` on: what the density of a warp should be proportional to."""
        self._core.tell(first, np.ascontiguousarray(target, np.float32))


class Warp:
    """A trained density over the numbers of a layout: what `train` returns, or a file that `warpath train` wrote.

    Attributes:
        layout: the numbers that it warps.
        family: "mixture" where a share of uniform samples is mixed in, else "kdtree", "realnvp", ...
        settings: what it was trained with, by name.
    """

    def __init__(self, core: _core.Warp):
        self._core = core
        self.layout = Layout(core.layout.name)
        self.family: str = core.family
        self.settings: dict[str, str] = core.settings

    def draw(self, first: int, count: int, seed: int = 0, *, stratified: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Samples `first` ... `first + count - 1` of a seed.

        Returns y, D x `count`, and 1 / density, both float32: the mean of f(y) / density estimates the integral of f.
        `stratified`: the shares of a mixture's components are the same in each 2,048 samples; switch it off where samples are of
        different integrals, such as pixels.
        """
        y, inv_q = np.empty((self.layout.dims, count), np.float32), np.empty(count, np.float32)
        self._core.draw(seed, first, y, inv_q, stratified)
        return y, inv_q

    def density(self, y: np.ndarray) -> np.ndarray:
        """The density at each of N x D points."""
        y = np.ascontiguousarray(y, float)
        log_q = np.empty(len(y))
        self._core.log_density(y, log_q)
        return np.exp(log_q)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes safetensors that the command line reads, too."""
        self._core.save(os.fspath(path))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Warp:
        """What `save` or `warpath train` wrote. Raises OSError, and ValueError for a field, which draws at vertices."""
        return cls(_core.Warp.load(os.fspath(path)))

    def __repr__(self) -> str:
        return f"Warp({self.settings.get('method', self.family)!r})"


def training_options(options: dict[str, Any]) -> _core.TrainingOptions:
    """`options` by their names on the command line, with _ in place of -; ValueError for one that there is not."""
    core = _core.TrainingOptions()
    for name, value in options.items():
        core.set(name, os.fspath(value) if isinstance(value, os.PathLike) else str(value))
    return core


def train(candidates: Candidates, family: str = "kdtree", *, init: Warp | None = None, seed: int = 0, **options: Any) -> Warp:
    """Fits a density that is proportional to the targets of the candidates, and mixes it with the uniform one.

    Args:
        candidates: all of them told.
        family: "kdtree", "realnvp", "spline", "grid" or "uniform".
        init: a warp to start from.
        seed: of resampling and of the flows' first weights.
        options: those of the command line, with _ in place of -: `epp`, `alpha`, `uniform_share`, `max_steps`, `leaves`, ...

    Example: two numbers, a peak.

        >>> import numpy as np, warpath
        >>> candidates = warpath.Candidates("film", 20_000)
        >>> def g(y):
        ...     return np.exp(-50 * ((y - 0.7) ** 2).sum(axis=0))
        >>> candidates.tell(0, g(candidates.primary_samples(0, 20_000)))
        >>> warp = warpath.train(candidates, "kdtree")
        >>> y, inv_q = warp.draw(0, 10_000)
        >>> estimates = g(y) * inv_q
        >>> bool(abs(estimates.mean() - np.pi / 50) < 0.001 and estimates.std() < 0.5 * estimates.mean())
        True
    """
    return Warp(_core.train(candidates._core, family, training_options(options), seed, init._core if init else None))
