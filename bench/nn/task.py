"""The networks of the flows, two residual blocks, one thread: share of what a loop of nothing but FMAs reaches in the same run, and
speed over oneDNN and PyTorch. Training has rows of its own for products of floats; where the CPU multiplies bfloat16, it does better."""
from pathlib import Path

from harness import Bound, Missing, Row

HERE = Path(__file__).resolve().parent
WIDTHS = (32, 64, 128)
#: Of training, over PyTorch as it is; with its automatic bfloat16 for information.
LEAST_SPEED = {"forward": Bound(least=1.0), "train": Bound(least=2.4)}
BLOCK, STEP = 64, 2048  # samples of one iteration of the two benchmarks


def rows(bench):
    ours = bench.counters("nn")
    samples = {"forward": BLOCK, "train/floats": STEP, "train/fastest": STEP}
    for kind, least in (("forward", 0.90), ("train/floats", 0.80), ("train/fastest", 0.80)):
        for width in WIDTHS:
            row = ours[f"{kind}/{width}"]
            note = f"{row['cpu_time'] / samples[kind]:.0f} ns a sample, peak {row['peak_GFLOP/s']:.0f} GFLOP/s"
            yield Row(f"{kind}, {width} wide, of the FMA peak", row["of_peak"], "", Bound(least=least), note)
    nanoseconds = {kind: {width: ours[f"{kind}/{width}"]["cpu_time"] / samples[kind] for width in WIDTHS} for kind in samples}
    peers = {
        "oneDNN": lambda: {"forward": bench.json(bench.binary("nn_onednn"), environment={"OMP_NUM_THREADS": "1"})},
        "PyTorch": lambda: bench.torch(HERE / "pytorch.py"),
    }
    for name, peer in peers.items():
        try:
            theirs = peer()
        except Missing as missing:
            yield Row(f"speed over {name}", None, note=str(missing))
            continue
        for kind in theirs:
            for width in WIDTHS:
                ours_of_kind = "forward" if kind == "forward" else "train/fastest"
                speed = theirs[kind][str(width)] / nanoseconds[ours_of_kind][width]
                yield Row(f"{kind}, {width} wide, speed over {name}", speed, "×", LEAST_SPEED.get(kind))
