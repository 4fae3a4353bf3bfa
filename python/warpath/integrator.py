"""The integrator that people call."""

from __future__ import annotations

import os
import warnings
from typing import Any, Callable, NamedTuple, Sequence

import numpy as np

from . import _core
from .integrand import Integrand
from .result import Result

MEMORY = 2**20


class Sample(NamedTuple):
    """Points that follow a warp."""

    x: np.ndarray  #: N x D, within the bounds
    weight: np.ndarray  #: N, 1 / density: mean(weight * f(x)) estimates the integral of f
    density: np.ndarray  #: N


class Integrator:
    """Integrates functions over a box, and learns a warp that puts points where they count.

    Args:
        bounds: D pairs (low, high), or a D x 2 array.
        warp: "auto", which refines a grid and puts a spline flow in front of it where that pays; "grid+spline", which has both in
            any case; or one of "uniform", "grid", "kdtree", "realnvp", "spline". Flows have 32 dimensions at most, kd-trees too, the others 256.
        seed: the same seed gives the same numbers, whatever the number of threads.
        sampler: "sobol", scrambled points whose error falls faster than that of independent ones, or "independent".
        memory: most points of past iterations that are learned from.

    Example: adapt first, then measure with a warp that no longer changes.

        >>> import numpy as np, warpath
        >>> def f(x):
        ...     return np.exp(-100 * ((x - 0.5) ** 2).sum(axis=1)) * (100 / np.pi) ** 2
        >>> integrator = warpath.Integrator([(0, 1)] * 4)
        >>> _ = integrator(f, nitn=6, neval=20_000)
        >>> result = integrator(f, nitn=4, neval=20_000, adapt=False)
        >>> abs(result.mean - 1) < 6 * result.sdev and result.sdev < 2e-3
        True
    """

    def __init__(self, bounds: Sequence[Sequence[float]] | np.ndarray, warp: str = "auto", *, seed: int = 0, sampler: str = "sobol",
                 memory: int = MEMORY):
        pairs = np.asarray(bounds, dtype=float)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise ValueError(f"bounds have the shape {pairs.shape}, not D x 2: a pair (low, high) for each dimension")
        self._core = _core.Integrator([tuple(pair) for pair in pairs.tolist()], warp, seed, sampler, memory)

    @property
    def dims(self) -> int:
        return self._core.dims

    @property
    def bounds(self) -> np.ndarray:
        """D x 2."""
        return np.array(self._core.bounds)

    @property
    def warp(self) -> str:
        """What draws now: "uniform", "grid", "grid+spline", ..."""
        return self._core.warp

    def __call__(self, f: Callable[[np.ndarray], Any], nitn: int = 10, neval: float = 100_000, *, adapt: bool = True,
                 callback: Callable[[Result], Any] | None = None, max_batch: int = 65_536) -> Result:
        """Estimates the integral of `f`, or of each of the functions that it returns.

        Args:
            f: gets up to `max_batch` points, N x D, and returns N values, or N x ... for several integrals; integrands made for
                `vegas` work as they are. An exception that it raises comes through, with the points in its attribute `batch`.
            nitn: iterations.
            neval: points of each, at most; what is left over by sequences of a power of two (a few percent) is not drawn.
            adapt: whether the warp learns from each iteration, by the first of several integrals. Without, the mean is unbiased.
            callback: called after each iteration with the result so far; integration ends when it returns True.
        """
        if nitn < 1:
            raise ValueError(f"nitn is {nitn}; there must be at least 1 iteration")
        integrand, iterations = Integrand(f), []
        for _ in range(nitn):
            iterations.append(self._iteration(integrand, int(neval), adapt, max_batch))
            if callback is not None and callback(Result(iterations, integrand.shape or ())):
                break
        result = Result(iterations, integrand.shape or ())
        if result.non_finite:
            warnings.warn(f"{result.non_finite} of {result.sum_neval} values were not finite; they count as zero", RuntimeWarning, stacklevel=2)
        if not adapt and np.any(result.Q < 0.05):
            warnings.warn(f"iterations differ by more than their errors tell (Q = {np.min(result.Q):.2g}): more points, or more adaptation first",
                          RuntimeWarning, stacklevel=2)
        return result

    def _iteration(self, integrand: Integrand, neval: int, adapt: bool, max_batch: int) -> _core.Iteration:
        count = self._core.begin(neval)
        for first in range(0, count, max_batch):
            # Arrays of their own for every batch: f may keep them.
            rows = min(max_batch, count - first)
            x, weight = np.empty((rows, self.dims)), np.empty(rows)
            self._core.draw(first, x, weight)
            x.flags.writeable = False
            self._core.add(x, weight, integrand(x))
        return self._core.end(adapt)

    def sample(self, n: int) -> Sample:
        """`n` independent points that follow the warp, new ones with each call."""
        x, weight = np.empty((n, self.dims)), np.empty(n)
        self._core.sample(x, weight)
        return Sample(x, weight, 1 / weight)

    def density(self, x: np.ndarray) -> np.ndarray:
        """The density with which the warp draws each of N x D points; 0 outside of the bounds."""
        x = np.ascontiguousarray(x, dtype=float)
        weight = np.empty(len(x))
        self._core.weights(x, weight)
        return 1 / weight

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes bounds and warp as safetensors."""
        self._core.save(os.fspath(path))

    @classmethod
    def load(cls, path: str | os.PathLike[str], warp: str = "auto", *, seed: int = 0, sampler: str = "sobol", memory: int = MEMORY) -> Integrator:
        """What `save` wrote, ready to measure or to learn on. `warp` must be its family, or "auto": then it is."""
        self = cls.__new__(cls)
        self._core = _core.Integrator.load(os.fspath(path), warp, seed, sampler, memory)
        return self
