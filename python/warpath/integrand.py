"""What people pass as an integrand, as a function of an N x D array that returns an N x C array."""

from __future__ import annotations

from typing import Any, Callable

import numpy as np


class Integrand:
    """Calls `f` with batches, whatever it is like, and remembers the shape of what it returns.

    A function gets N x D points and returns N values, or N x ... of them for several integrals. The decorators and base
    classes of `vegas` are understood: `batchintegrand` and `lbatchintegrand`, `rbatchintegrand` (D x N points, ... x N
    values) and functions of a single point (`fcntype` is "scalar").
    """

    def __init__(self, f: Callable[[np.ndarray], Any]):
        if not callable(f):
            raise TypeError(f"the integrand is a {type(f).__name__}, which cannot be called")
        self._f = f
        self._kind = getattr(f, "fcntype", "lbatch")
        if self._kind not in ("lbatch", "rbatch", "scalar"):
            raise TypeError(f'an integrand of the kind "{self._kind}"; known: lbatch, rbatch, scalar')
        self.shape: tuple[int, ...] | None = None  #: of one point's values

    def __call__(self, x: np.ndarray) -> np.ndarray:
        try:
            values = self._values(x)
        except Exception as error:
            # Whoever looks into what went wrong finds the points there.
            error.batch = x  # type: ignore[attr-defined]
            raise
        if np.iscomplexobj(values):
            raise TypeError("the integrand returned complex values; integrate their real and imaginary parts as two integrals")
        if values.ndim == 0 or values.shape[0] != len(x):
            raise ValueError(f"the integrand returned an array of shape {values.shape} for {len(x)} points; its first axis must be theirs")
        if self.shape is None:
            self.shape = values.shape[1:]
        elif self.shape != values.shape[1:]:
            raise ValueError(f"the integrand returned values of shape {values.shape[1:]} after some of shape {self.shape}")
        return np.ascontiguousarray(values.reshape(len(x), -1))

    def _values(self, x: np.ndarray) -> np.ndarray:
        if self._kind == "rbatch":
            return np.moveaxis(_numbers(self._f(np.ascontiguousarray(x.T))), -1, 0)
        if self._kind == "scalar":
            return _numbers([self._f(point) for point in x])
        return _numbers(self._f(x))


def _numbers(values: Any) -> np.ndarray:
    """As floats; complex values stay so, since a cast would drop their imaginary parts."""
    array = np.asarray(values)
    return array if np.iscomplexobj(array) else np.asarray(array, dtype=float)
