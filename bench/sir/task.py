"""Resampling four million candidates into 512 k examples on all threads, against a copy of the same bytes and the standard library."""
from harness import Bound, Row


def rows(bench):
    row = bench.counters("sir")["sir/real_time"]
    note = f"{row['over_copy']:.1f} × a copy; {row['over_std']:.0f} × as fast as std::discrete_distribution"
    yield Row("4 M candidates", row["real_time"] / 1e3, "s", Bound(most=0.1), note)
