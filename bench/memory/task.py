"""The most memory that rendering the kitchen holds, against Mitsuba 3 in its leanest variant."""
import tempfile
from pathlib import Path

from harness import SIZE, Bound, Row, run_and_measure

HERE = Path(__file__).resolve().parent
LARGE = "1280x720"
MiB = 1 << 20


def rows(bench):
    scene = bench.scene("country-kitchen")
    with tempfile.TemporaryDirectory() as folder:

        def ours(size, spp):
            options = ["--warp", "none", "--size", size, "--spp", spp, "--threads", "2", "--quiet"]
            return run_and_measure([bench.warpath, "render", scene, *options, "-o", Path(folder) / "image.exr"])[1]

        used = {(size, spp): ours(size, spp) for size, spp in ((SIZE, 4), (SIZE, 64), (LARGE, 1), (LARGE, 4))}
    for size, spp in ((SIZE, 4), (LARGE, 1)):
        theirs = bench.mitsuba(HERE / "mitsuba3.py", "scalar_rgb", scene, size, spp)["bytes"]
        note = f"{used[size, spp] / MiB:.0f} MiB, {theirs / MiB:.0f} MiB there"
        yield Row(f"{size}, over Mitsuba's scalar_rgb", used[size, spp] / theirs, "×", Bound(most=1.0), note)
    yield Row(f"{SIZE}, 64 spp over 4 spp", used[SIZE, 64] / used[SIZE, 4], "×", Bound(most=1.02))
    yield Row(f"{LARGE}, 4 spp over 1 spp", used[LARGE, 4] / used[LARGE, 1], "×", Bound(most=1.02))
