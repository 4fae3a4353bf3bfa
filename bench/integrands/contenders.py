"""Who races: each adapts with about 10^6 calls, then measures with about 10^6 of a map that no longer changes."""
import time
from typing import NamedTuple

import numpy as np

NITN, NEVAL = 10, 100_000


class Outcome(NamedTuple):
    mean: float
    sdev: float
    calls: int  #: of the measurement
    adapt_seconds: float  #: CPU seconds of all threads, as the machine may have other work
    measure_seconds: float
    trained: int = 0  #: examples that networks were trained on, each as often as it was used

    @property
    def seconds(self):
        return self.adapt_seconds + self.measure_seconds


def timed(action):
    start = time.process_time()
    result = action()
    return result, time.process_time() - start


def warpath(task, seed, neval=NEVAL):
    import warpath

    integrator = warpath.Integrator([(0, 1)] * task.dims, seed=seed)
    adaptation, adapt = timed(lambda: integrator(task.f, nitn=NITN, neval=neval))
    result, measure = timed(lambda: integrator(task.f, nitn=NITN, neval=neval, adapt=False))
    return Outcome(result.mean, result.sdev, result.sum_neval, adapt, measure, sum(i.trained for i in adaptation.itn_results))


def vegas(task, seed, neval=NEVAL, stratified=True):
    import gvar
    import vegas

    gvar.ranseed(seed)
    f = vegas.batchintegrand(lambda x: task.f(np.asarray(x)))
    integrator = vegas.Integrator([[0, 1]] * task.dims)
    # nstrat switches stratification off only where neval stands in the same call.
    options = {"nitn": NITN, "neval": neval, **({} if stratified else {"nstrat": [1] * task.dims})}
    _, adapt = timed(lambda: integrator(f, **options))
    result, measure = timed(lambda: integrator(f, adapt=False, **options))
    return Outcome(result.mean, result.sdev, result.sum_neval, adapt, measure)


def vegas_map(task, seed, neval=NEVAL):
    return vegas(task, seed, neval, stratified=False)


def madnis(task, seed, neval=NEVAL):
    """MadNIS as it did best here: fresh samples, 1,024 a step, as many in all as the others adapt with, and a step size that falls
    from 0.02 to 0 along a cosine. With its default, 0.001 all the way, errors are 2 to 3 times larger."""
    import torch
    from madnis.integrator import Integrator

    torch.manual_seed(seed)
    torch.set_num_threads(1)
    steps = NITN * neval // 1024
    integrator = Integrator(
        lambda x: torch.from_numpy(task.f(x.detach().numpy())).to(x.dtype),
        dims=task.dims,
        learning_rate=2e-2,
        scheduler=lambda optimiser: torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps),
    )
    _, adapt = timed(lambda: integrator.train(steps))
    with torch.no_grad():
        (mean, sdev), measure = timed(lambda: integrator.integrate(NITN * neval))
    return Outcome(float(mean), float(sdev), NITN * neval, adapt, measure, steps * 1024)


CONTENDERS = {"warpath": warpath, "vegas+": vegas, "vegas without strata": vegas_map, "MadNIS": madnis}
