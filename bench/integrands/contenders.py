"""Who races: each adapts with about 10^6 calls, then measures with about 10^6 of a map that no longer changes."""
import time
from typing import NamedTuple

import numpy as np

NITN, NEVAL = 10, 100_000


class Outcome(NamedTuple):
    mean: float
    sdev: float
    calls: int  #: of the measurement
    adapt_seconds: float
    measure_seconds: float


def timed(action):
    start = time.perf_counter()
    result = action()
    return result, time.perf_counter() - start


def warpath(task, seed):
    import warpath

    integrator = warpath.Integrator([(0, 1)] * task.dims, seed=seed)
    _, adapt = timed(lambda: integrator(task.f, nitn=NITN, neval=NEVAL))
    result, measure = timed(lambda: integrator(task.f, nitn=NITN, neval=NEVAL, adapt=False))
    return Outcome(result.mean, result.sdev, result.sum_neval, adapt, measure)


def vegas(task, seed, stratified=True):
    import gvar
    import vegas

    gvar.ranseed(seed)
    f = vegas.batchintegrand(lambda x: task.f(np.asarray(x)))
    integrator = vegas.Integrator([[0, 1]] * task.dims)
    # nstrat switches stratification off only where neval stands in the same call.
    options = {"nitn": NITN, "neval": NEVAL, **({} if stratified else {"nstrat": [1] * task.dims})}
    _, adapt = timed(lambda: integrator(f, **options))
    result, measure = timed(lambda: integrator(f, adapt=False, **options))
    return Outcome(result.mean, result.sdev, result.sum_neval, adapt, measure)


def vegas_map(task, seed):
    return vegas(task, seed, stratified=False)


CONTENDERS = {"warpath": warpath, "vegas+": vegas, "vegas, no strata": vegas_map}
