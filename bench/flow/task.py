"""Whole flows on one thread against what a prototype of these kernels took, scaled by the two machines' FMA peaks."""
from harness import PROTOTYPE_PEAK, Bound, Row

#: Nanoseconds a sample of the prototype: inference, training.
PROTOTYPE = {
    "spline/d4/w32/K8/c2": (104, 295),
    "spline/d4/w32/K8/c4": (None, 600),
    "spline/d4/w64/K16/c2": (302, 918),
    "spline/d4/w64/K16/c4": (611, 1850),
    "spline/d8/w32/K8/c4": (336, 950),
    "spline/d8/w32/K16/c4": (473, 1366),
    "spline/d8/w64/K16/c4": (924, 2837),
    "realnvp/d8/w64/c6/shared": (826, 2850),
    "realnvp/d8/w64/c6/separate": (1678, 5620),
}


def rows(bench):
    results = bench.counters("flow", "^(forward|train)/")
    for name, nanoseconds in PROTOTYPE.items():
        for kind, reference in zip(("forward", "train"), nanoseconds):
            if reference is None:
                continue
            row = results[f"{kind}/{name}"]
            ours, allowed = row["cpu_time"] / row["samples"], reference * PROTOTYPE_PEAK / row["peak_GFLOP/s"]
            yield Row(f"{kind} {name}, over the prototype", ours / allowed, "×", Bound(most=1.1), f"{ours:.0f} ns a sample, {allowed:.0f} there")
