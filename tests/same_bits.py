#!/usr/bin/env python3
"""Hashes of small runs of everything that draws or learns: what a change of the code, not of what it does, must leave alone.

  same_bits.py BUILD > before.txt            hashes of the build folder before a change
  same_bits.py BUILD --against before.txt    after it: exits with 1, and names the runs, if any differs

BUILD holds `warpath` and, if the runs in Python are to be there too, `venv` as python_test leaves it. Hashes hold on one machine:
the last bits depend on its instruction set.
"""

import argparse
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[1]
BOX, STUDY, AJAR = (SOURCE / "scenes" / name / "scene.xml" for name in ("box", "study", "ajar"))
SMALL = "--size 48x32 --seed 5 --quiet".split()
FIRST_HIT = "bounce1.lobe+bounce1"

# Images: name, scene, options.
RENDERS = {
    "none": (STUDY, "--warp none --spp 6 --max-depth 5"),
    "none-sobol": (BOX, "--warp none --spp 9 --sampler sobol"),
    "none-crop-aov": (BOX, "--warp none --spp 2 --crop 8,4,20,16 --aov albedo,normal,depth"),
    "uniform": (BOX, "--warp uniform:film+bounce1 --spp 4"),
    "grid": (BOX, "--warp grid:film+bounce1 --spp 4 --examples 4000"),
    "kdtree": (BOX, "--warp kdtree:film+bounce1 --spp 4 --examples 4000"),
    "kdtree-published": (BOX, "--warp kdtree:film+bounce1 --spp 4 --examples 4000 --kdtree-split cyclic --kdtree-target mean"),
    "kdtree-use": (BOX, "--warp kdtree:film+bounce1 --spp 4 --examples 4000 --training-samples use"),
    "kdtree-light": (BOX, "--warp kdtree:bounce1.light_uv --spp 4 --examples 4000"),
    "realnvp": (BOX, "--warp realnvp:film+bounce1 --spp 4 --examples 4000 --max-steps 60"),
    "realnvp-options": (BOX, "--warp realnvp:film+bounce1 --spp 4 --examples 4000 --max-steps 60 --couplings 4 --width 16 --blocks 2 "
                             "--encoding-bins 7 --rate 0.004 --jitter 1 --batch 512 --loss likelihood --masks alternating "
                             "--networks separate --bn batch"),
    "spline": (BOX, "--warp spline:film+bounce1 --spp 4 --examples 4000 --max-steps 150"),
    "spline-options": (BOX, f"--warp spline:film+{FIRST_HIT} --spp 4 --examples 4000 --max-steps 60 --couplings 4 --width 16 --bins 6 "
                            "--uniform-share 0.2"),
    "conditional-kdtree": (STUDY, f"--warp conditional-kdtree:{FIRST_HIT} --spp 12 --max-depth 5"),
    "conditional-spline": (STUDY, f"--warp conditional-spline:{FIRST_HIT} --spp 6 --max-depth 5"),
    "field": (AJAR, "--warp field --spp 24 --max-depth 6"),
    "field-sobol-mse": (STUDY, "--warp field --spp 9 --sampler sobol --objective mse --max-depth 5"),
    "field-first-hit": (STUDY, f"--warp field:{FIRST_HIT} --spp 9 --objective even --cells 64 --max-depth 5"),
    "auto": (AJAR, "--warp auto --spp 40 --max-depth 6"),
}  # fmt: skip

# Calls of Python that print numbers.
INTEGRATOR = """
import numpy as np, warpath
def f(x):
    return np.stack([np.exp(-60 * ((x - 0.4) ** 2).sum(1)) + 0.1 * x[:, 0], x[:, 1] ** 2], 1)
integrator = warpath.Integrator([(0, 1)] * {dims}, warp="{warp}", seed=3)
integrator(f, nitn=3, neval={neval})
result = integrator(f, nitn=2, neval=4000, adapt=False)
print([m.hex() for m in result.mean], [s.hex() for s in result.sdev], integrator.warp)
"""
RENDER = """
import hashlib, numpy as np, warpath
scene = warpath.load_scene("{box}", size=(48, 32))
image = warpath.render(scene, spp=4, warp="{warp}", seed=2, {options})
print(hashlib.sha256(np.ascontiguousarray(image).tobytes() + np.ascontiguousarray(image.variance).tobytes()).hexdigest())
"""


class Runs:
    def __init__(self, build, folder):
        self.binary, self.python, self.folder = build / "warpath", build / "venv" / "bin" / "python", folder

    def call(self, *words):
        done = subprocess.run([*map(str, words)], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")
        return done.stdout

    def warpath(self, *words):
        return self.call(self.binary, *words)

    def image(self, name, scene, *options):
        file = self.folder / f"{name}.exr"
        self.warpath("render", scene, "-o", file, *SMALL, *options)
        return self.call("oiiotool", "--hash", file).split()[-1]

    def warp(self, name, scene, *options):
        """The tensors of a trained warp; what its header says of times may differ."""
        file = self.folder / f"{name}.warp"
        self.warpath("train", scene, "-o", file, *SMALL, *options)
        data = file.read_bytes()
        return hashlib.sha256(data[8 + int.from_bytes(data[:8], "little"):]).hexdigest()

    def comparison(self):
        """Errors of two methods, one of them under a clock, and the same passes again."""
        words = ["--methods", "none,kdtree:film+bounce1", "--spp", 4, "--examples", 4000, "--runs", 2, "--reference-spp", 32]
        self.warpath("compare", BOX, "--report", self.folder / "report", *SMALL, *words)
        runs = json.loads((self.folder / "report" / "results.json").read_text())["results"]
        yield "compare", digest([[run[key] for key in ("method", "seed", "mse", "relmse", "mse_rest", "mse_predicted", "mean")] for run in runs])
        # What a clock decided differs from call to call, so the passes that are rendered again are given.
        passes = [
            (1, 2, True, "none", ""),
            (1, 2, False, "none", ""),
            (2, 3, True, "none", ""),
            (4, 5, True, "field", "field"),
            (6, 7, False, "field", ""),
        ]
        keys = ("spp", "batches", "teaches", "drawn_by", "chosen")
        run = {"method": "auto", "size": "48x32", "seed": 5, "passes": [dict(zip(keys, p)) for p in passes]}
        recorded = self.folder / "recorded.json"
        recorded.write_text(json.dumps({"results": [run]}))
        yield "replay", self.image("replay", BOX, "--warp", "auto", "--replay", recorded)

    def hashes(self):
        for name, (scene, options) in RENDERS.items():
            yield name, self.image(name, scene, *options.split())
        yield "train-kdtree", self.warp("train-kdtree", BOX, *"--warp kdtree:film+bounce1 --examples 4000".split())
        yield "train-realnvp", self.warp("train-realnvp", BOX, *"--warp realnvp:film+bounce1 --examples 4000 --max-steps 20".split())
        yield "train-field", self.warp("train-field", AJAR, *"--warp field --examples 4000 --max-depth 6".split())
        started = ["--init", self.folder / "train-realnvp.warp", "--warp", "realnvp:film+bounce1"]
        yield "init-realnvp", self.image("init-realnvp", BOX, *started, *"--spp 4 --examples 4000 --max-steps 30".split())
        started = ["--init", self.folder / "train-field.warp", "--warp", "field"]
        yield "init-field", self.image("init-field", AJAR, *started, *"--spp 4 --max-depth 6".split())
        yield "saved", self.image("saved", BOX, "--warp", self.folder / "train-kdtree.warp", "--spp", 4)
        yield from self.comparison()
        if self.python.exists():
            for warp in ("auto", "uniform", "grid", "kdtree", "realnvp", "spline", "grid+spline"):
                for dims, neval in ((2, 3000), (5, 6000)):
                    code = INTEGRATOR.format(dims=dims, warp=warp, neval=neval)
                    yield f"integrator-{warp}-{dims}d", digest(self.call(self.python, "-c", code))
            for warp, options in {"kdtree:film+bounce1": "examples=4000", "field": "objective='mse'"}.items():
                yield f"python-{warp}", self.call(self.python, "-c", RENDER.format(box=BOX, warp=warp, options=options)).strip()


def digest(value):
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--against", type=pathlib.Path, help="hashes that must be the same")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        now = {}
        for name, value in Runs(options.build.resolve(), pathlib.Path(folder)).hashes():
            now[name] = value
            print(f"{value[:16]} {name}", flush=True)
    if not options.against:
        return 0
    before = dict(reversed(line.split()) for line in options.against.read_text().splitlines())
    changed = [name for name, value in now.items() if before.get(name) != value[:16]]
    print(f"{len(now) - len(changed)} of {len(now)} the same" + (f"; others: {', '.join(changed)}" if changed else ""), file=sys.stderr)
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
