"""From the start of the process to the first ray of the kitchen, written image and end of the process included, against Mitsuba's
load_file alone: the best of five and of three."""
import tempfile
from pathlib import Path

from harness import SIZE, Bound, Row, run_and_measure

HERE = Path(__file__).resolve().parent


def rows(bench):
    scene = bench.scene("country-kitchen")
    with tempfile.TemporaryDirectory() as folder:
        command = [bench.warpath, "render", scene, "--size", SIZE, "--crop", "0,0,1,1", "--spp", "1", "--quiet", "-o", Path(folder) / "one.exr"]
        ours = min(run_and_measure(command)[0] for _ in range(5))
    yield Row("kitchen, process with one path", ours, "s")
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        theirs = min(bench.mitsuba(HERE / "mitsuba3.py", variant, scene, SIZE)["seconds"] for _ in range(3))
        yield Row(f"time over load_file in {variant}", ours / theirs, "×", Bound(most=1.0), f"{theirs:.2f} s there")
