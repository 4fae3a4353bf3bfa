"""What a second thread brings, over what it brings to a loop of nothing but FMAs."""
from harness import SIZE, Bound, Missing, Row

SPP = 16


def rows(bench):
    seconds = bench.json(bench.binary("threads"))
    limit = seconds["fma"][0] / seconds["fma"][1]
    yield Row("FMAs, 2 threads over 1", limit, "×")
    try:
        scene = bench.scene("country-kitchen")
        runs = [[min(bench.json(bench.binary("tracer"), scene, SIZE, SPP, threads, 2)["seconds"]) for threads in (1, 2)] for _ in range(3)]
        seconds["tracing"] = [min(times) for times in zip(*runs)]
    except Missing as missing:
        yield Row("tracing", None, note=str(missing))
    for name in ("tracing", "training", "warping"):
        if name in seconds:
            gain = seconds[name][0] / seconds[name][1]
            yield Row(f"{name}, of the FMAs' gain", gain / limit, "", Bound(least=0.95), f"{gain:.2f} × on 2 threads")
