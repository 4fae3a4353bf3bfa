"""The kd-tree warp in four dimensions, 2^14 leaves: one thread draws, all build."""
from harness import Bound, Row


def rows(bench):
    results = bench.counters("kdtree")
    yield Row("forward with density", results["forward"]["ns/sample"], "ns", Bound(most=100),
              f"{results['forward']['over_plain']:.1f} × as fast as a plain descent")  # fmt: skip
    yield Row("density alone", results["log_density"]["ns/sample"], "ns", None, f"{results['log_density']['over_plain']:.1f} × as fast")
    yield Row("build from 512 k examples", results["build/real_time"]["real_time"] / 1e3, "s", Bound(most=1.0))
