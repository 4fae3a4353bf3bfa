"""What an integration found."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from . import _core


class Result:
    """Several iterations together, with the names that users of `vegas` know.

    Iterations of a fixed warp weigh by their number of points, which keeps the mean unbiased; those between which the warp
    adapted weigh by the inverse of their variances, which is consistent. A function that returns N values has scalars here;
    one that returns N x ... values has arrays of that shape.

    Attributes:
        itn_results: the iterations: mean, sdev(), neval, warp, effective_samples, unweighting_efficiency, ...
    """

    def __init__(self, iterations: Sequence[_core.Iteration], shape: tuple[int, ...] = ()):
        self.itn_results = list(iterations)
        self.shape = shape
        self._all = _core.Integral(self.itn_results)

    def _each(self, value):
        values = np.array([value(c) for c in range(self._all.count)]).reshape(self.shape)
        return values if self.shape else float(values)

    @property
    def mean(self):
        """The estimate."""
        return self._each(self._all.mean)

    @property
    def sdev(self):
        """Its standard error."""
        return self._each(self._all.sdev)

    @property
    def chi2(self):
        """How far the iterations are from each other: sum of (theirs - mean)^2 / variance."""
        return self._each(self._all.chi2)

    @property
    def Q(self):
        """The probability of a chi2 at least as large. Below 0.05: the errors are not to be trusted."""
        return self._each(self._all.Q)

    @property
    def dof(self) -> int:
        """Degrees of freedom of chi2."""
        return self._all.dof

    @property
    def cov(self) -> np.ndarray:
        """Covariance of the C estimates, C x C."""
        return np.array(self._all.covariance).reshape(self._all.count, -1)

    @property
    def sum_neval(self) -> int:
        """Points of all iterations."""
        return self._all.neval

    @property
    def non_finite(self) -> int:
        """Points where f was NaN or infinite; they count as zero."""
        return self._all.non_finite

    @property
    def effective_samples(self) -> float:
        """Of the first integral: (sum |w|)^2 / sum w^2 with w = f / density, over the last iteration."""
        return self.itn_results[-1].effective_samples

    @property
    def unweighting_efficiency(self) -> float:
        """Of the first integral: mean |w| / max |w| over the last iteration, the share that unweighting accepts."""
        return self.itn_results[-1].unweighting_efficiency

    def converged(self, rtol: float = 0.0, atol: float = 0.0) -> bool:
        """Whether every sdev is at most max(atol, rtol |mean|)."""
        return self._all.converged(rtol, atol)

    def summary(self) -> str:
        """A table of the first integral, a line for each iteration."""
        return self._all.summary()

    def __str__(self) -> str:
        text = [_core.with_error(self._all.mean(c), self._all.sdev(c)) for c in range(self._all.count)]
        return text[0] if not self.shape else "[" + " ".join(text) + "]"

    def __repr__(self) -> str:
        return f"Result({self}, Q={np.min(self.Q):.2f}, sum_neval={self.sum_neval})"
