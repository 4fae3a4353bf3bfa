"""What one warped sample costs with its density, drawn as the estimator does it from the mixture with the uniform proposal, on one
thread; and the share of a render's time that goes into it."""
from harness import PROTOTYPE_PEAK, SIZE, Bound, Missing, Row

#: Nanoseconds on a core with PROTOTYPE_PEAK; elsewhere as many more as its FMAs are slower.
MOST = {
    "spline/d4/w32/K8/c2": 120,
    "spline/d4/w64/K16/c4": 650,
    "realnvp/d8/w64/c6/shared": 850,
    "realnvp/d8/w64/c6/separate": 1700,
}
SPP, THREADS = 16, 2


def rows(bench):
    results = bench.counters("flow", "^draw/")
    for name, most in MOST.items():
        row = results[f"draw/{name}"]
        bound = Bound(most=round(most * PROTOTYPE_PEAK / row["peak_GFLOP/s"]))
        yield Row(name, row["cpu_time"] / row["samples"], "ns", bound, f"{most} at {PROTOTYPE_PEAK} GFLOP/s")
    try:
        scene = bench.scene("country-kitchen")
    except Missing as missing:
        yield Row("share of a render", None, note=str(missing))
        return
    for name in MOST:
        run = bench.json(bench.binary("tracer"), scene, SIZE, SPP, THREADS, 1, name)
        yield Row(f"{name}, share of rendering the kitchen", 100 * run["warp_share"][0], "%")
