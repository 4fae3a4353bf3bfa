"""The integrands of the race, on [0,1]^d, with their integrals [Deutschmann and Götz 2023, CoVVVR; the documentation of vegas]."""
import math
from typing import Callable, NamedTuple

import numpy as np

SIGMA = 0.2


class Task(NamedTuple):
    name: str
    dims: int
    f: Callable[[np.ndarray], np.ndarray]  #: N x d -> N
    exact: float


def peak(x, centre):
    return np.exp(-((x - centre) ** 2).sum(axis=1) / SIGMA**2) * (SIGMA * math.sqrt(math.pi)) ** -x.shape[1]


def gauss(dims):
    return Task(f"gauss {dims}", dims, lambda x: peak(x, 0.5), math.erf(0.5 / SIGMA) ** dims)


def camel(dims):
    one = 0.5 * (math.erf(2 / (3 * SIGMA)) + math.erf(1 / (3 * SIGMA)))
    return Task(f"camel {dims}", dims, lambda x: 0.5 * (peak(x, 1 / 3) + peak(x, 2 / 3)), one**dims)


def circles():
    def ring(height, x, centre):
        return height**3 * np.exp(-250 * np.abs((x[:, 0] - centre[0]) ** 2 + (x[:, 1] - centre[1]) ** 2 - 0.0625))

    return Task("circles 2", 2, lambda x: ring(x[:, 1], x, (0.4, 0.6)) + ring(1 - x[:, 1], x, (0.6, 0.4)), 0.01368477)


def polynomial(dims):
    return Task(f"polynomial {dims}", dims, lambda x: (x - x * x).sum(axis=1), dims / 6)


TASKS = [*(gauss(d) for d in (2, 4, 8, 16)), *(camel(d) for d in (2, 4, 8, 16)), circles(), *(polynomial(d) for d in (18, 54, 96))]
