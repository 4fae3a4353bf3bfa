"""Plain path tracing at scene defaults against Mitsuba 3, on two threads: seconds of one image, the best of three, in the same run."""
from pathlib import Path

from harness import SIZE, Bound, Row

HERE = Path(__file__).resolve().parent
SPP, THREADS = 64, 2
BOUNDS = {"llvm_ad_rgb": Bound(least=1.0, goal=1.5), "scalar_rgb": Bound(least=2.0)}


def rows(bench):
    for scene in ("country-kitchen", "white-room"):
        file = bench.scene(scene)
        render = lambda: bench.json(bench.binary("tracer"), file, SIZE, SPP, THREADS, 3)  # noqa: B023, E731
        first = render()
        peers = {variant: bench.mitsuba(HERE / "mitsuba3.py", variant, file, SIZE, SPP, THREADS) for variant in BOUNDS}
        again = render()  # before and after the peers: machines drift
        best = min(first["seconds"] + again["seconds"])
        cpu = min(first["cpu_seconds"] + again["cpu_seconds"]) / first["paths"]
        yield Row(f"{scene}, paths per second", first["paths"] / best / 1e6, "million", note=f"{cpu * 1e6:.2f} µs of CPU a path")
        for variant, peer in peers.items():
            note = f"{min(peer['cpu_seconds']) / peer['paths'] * 1e6:.2f} µs of CPU a path there"
            yield Row(f"{scene}, speed over Mitsuba's {variant}", min(peer["seconds"]) / best, "×", BOUNDS[variant], note)
