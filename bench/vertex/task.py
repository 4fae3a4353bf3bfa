"""Drawing at a vertex, on one thread: finding out where it is, then the three numbers of light sampling and the three of scattering."""
from harness import Bound, Row

#: Nanoseconds for the first three numbers of a vertex.
MOST = {"field": 100, "kdtree of the first hit": 150, "spline of the first hit": None}


def rows(bench):
    results = bench.counters("vertex", "^draw/")
    for name, most in MOST.items():
        row = results[f"draw/{name}"]
        first = row["locate"] + max(row["light"], row["scatter"])
        note = f"{row['ns/vertex']:.0f} ns for six; {row['peak_GFLOP/s']:.0f} GFLOP/s peak"
        yield Row(f"{name}, three numbers", first, "ns", most and Bound(most=most), note)
