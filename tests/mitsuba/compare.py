#!/usr/bin/env python3
"""Does warpath make the image that Mitsuba 3 makes of the same scene file?

    python3 -m venv .venv && .venv/bin/pip install -r tests/mitsuba/requirements.txt
    .venv/bin/python tests/mitsuba/compare.py --warpath build/warpath [SCENE...]

Without SCENE: every scene in tests/scenes and scenes. Each is rendered by both in independent passes, whose spread gives the
standard errors. An image agrees if each channel's mean is within 0.15 % or 4 combined standard errors, and at least 99 % of the
4 x 4 pixel bins are within 4 combined standard errors. Of 180 scenes of equal images about one in five runs of the whole set
shows one false alarm in a mean; render that scene again with another --seed.

With --reference, warpath alone renders, and is compared with a stored image and the variance of its mean per pixel:

    compare.py kitchen/scene.xml --reference kitchen.exr --reference-variance kitchen.variance.exr --spp 1024

One line a scene; the exit code is 1 if any image disagrees. On CPUs with AVX-512 the LLVM variants need LLVM 16 or newer: set
DRJIT_LIBLLVM_PATH.
"""

import argparse
import hashlib
import re
import subprocess
import sys
import tempfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
BIN = 4
ALLOWED_ERRORS = 4.0
MEAN_TOLERANCE = 0.0015
BINS_WITHIN = 0.99
ROUNDING = 2e-4  # of a bin's value: what float32 and texture look-ups may differ where there is no noise


@dataclass
class Estimate:
    """Means with standard errors: of the whole image per channel, and of each bin per channel."""

    mean: np.ndarray  # 3
    mean_error: np.ndarray  # 3
    bins: np.ndarray  # H/4 x W/4 x 3
    bin_errors: np.ndarray  # H/4 x W/4 x 3
    passes: int = 0


def binned(image):
    """Means over bins of 4 x 4 pixels; rows and columns that fill no bin are left out."""
    height, width = (n - n % BIN for n in image.shape[:2])
    return image[:height, :width].reshape(height // BIN, BIN, width // BIN, BIN, 3).mean(axis=(1, 3))


def estimate_from_passes(images):
    """From independent images of equal sample counts: errors from their spread, so correlated neighbours need no model."""
    bins = np.stack([binned(i) for i in images])
    means = np.stack([i.mean(axis=(0, 1)) for i in images])
    n = len(images)
    return Estimate(means.mean(0), means.std(0, ddof=1) / n**0.5, bins.mean(0), bins.std(0, ddof=1) / n**0.5, n)


def correlation_of_bins(rfilter, size):
    """Standard error of a bin of `size` x `size` pixels over what independent pixels would give.

    The filter spreads each sample over several pixels: one at x adds w(x - p) to each pixel p. The variance of a pixel goes with
    the integral of w^2, that of the sum over a bin's B pixels with the integral of (sum over p of w(x - p))^2. Their ratio over B
    is the factor of the variance along one axis, so along both it is that of the error. 1.375 for the tent filter of radius 1
    and B = 4; 1 for the box.
    """
    if rfilter.radius() <= 0.5 + 1e-3:
        return 1.0
    step = 1 / 64
    single = np.array([rfilter.eval(float(x)) for x in np.arange(-8 + step / 2, 8, step)])
    summed = np.zeros(len(single) + 64 * (size - 1))
    for pixel in range(size):
        summed[64 * pixel : 64 * pixel + len(single)] += single
    return float((summed**2).sum() / (size * (single**2).sum()))


def estimate_from_variance(image, variance, rfilter):
    """From an image and the variance of its mean per pixel; neighbours are correlated by the filter."""
    pixels = image.shape[0] * image.shape[1]
    mean_error = correlation_of_bins(rfilter, 64) * np.sqrt(variance.sum(axis=(0, 1))) / pixels
    bin_errors = correlation_of_bins(rfilter, BIN) * np.sqrt(binned(variance)) / BIN
    return Estimate(image.mean(axis=(0, 1)), mean_error, binned(image), bin_errors)


def read_exr(path, layer=None):
    """R, G, B of an OpenEXR file as float64, or those of one of its layers; None if it has no such layer."""
    parts = mi.Bitmap(str(path)).split()
    for name, bitmap in parts:
        if name == (layer or "<root>"):
            return np.array(bitmap, dtype=np.float64)[..., :3]
    if layer is None:
        return np.array(parts[0][1], dtype=np.float64)[..., :3]
    return None


def first_seed(scene, options):
    """Another one for each scene, so that chance does not strike similar scenes alike."""
    return options.seed + zlib.crc32("/".join(scene.parts[-2:]).encode()) % 1_000_000_000


def render_with_warpath(scene, options, defines):
    """An estimate from independent runs of the command line."""
    images = []
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "image.exr"
        for run in range(options.runs):
            command = [options.warpath, "render", str(scene), "--warp", "none", "--spp", str(max(1, options.spp // options.runs))]
            command += ["--seed", str(first_seed(scene, options) + run), "--quiet", "-o", str(output)]
            for name, value in defines.items():
                command += ["-D", f"{name}={value}"]
            if options.max_depth:
                command += ["--max-depth", str(options.max_depth)]
            if options.size:
                command += ["--size", options.size]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(f"warpath: {(done.stderr or done.stdout).strip()}")
            images.append(read_exr(output))
    return estimate_from_passes(images)


def render_with_mitsuba(scene, options, defines):
    """An estimate from independent passes with different seeds."""
    loaded = mi.load_file(str(scene), **defines)
    spp = max(1, options.spp // options.passes)
    return estimate_from_passes(
        [np.array(mi.render(loaded, spp=spp, seed=first_seed(scene, options) + 1000 + i), dtype=np.float64)[..., :3]
         for i in range(options.passes)])  # fmt: skip


def cached(compute, scene, options, defines):
    """`compute`, or what it gave when it was last run with the same scene and settings."""
    if not options.cache:
        return compute(scene, options, defines)
    key = hashlib.sha256(repr((options.variant, options.spp, options.passes, options.seed, defines)).encode())
    for path in [scene, *sorted((ROOT / "tests/scenes/shared").glob("*.xml"))]:
        key.update(path.read_bytes())
    file = Path(options.cache) / f"{key.hexdigest()[:24]}.npz"
    if file.exists():
        return Estimate(**np.load(file))
    result = compute(scene, options, defines)
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez(file, **vars(result))
    return result


def judge(ours, theirs):
    """(agrees, text) for two estimates."""
    if ours.bins.shape != theirs.bins.shape:
        return False, f"sizes differ: {ours.bins.shape} and {theirs.bins.shape} bins"
    if not np.isfinite(ours.bins).all():
        return False, "warpath's image has values that are not finite"
    difference = ours.mean - theirs.mean
    error = np.hypot(ours.mean_error, theirs.mean_error)
    allowed = np.maximum(MEAN_TOLERANCE * np.abs(theirs.mean), ALLOWED_ERRORS * error)
    error_bins = np.hypot(ours.bin_errors, theirs.bin_errors)
    floor = ROUNDING * (np.abs(theirs.bins) + 0.01 * theirs.mean)
    z = (ours.bins - theirs.bins) / (error_bins + floor)
    within = float((np.abs(z) <= ALLOWED_ERRORS).mean())
    mean_agrees = bool((np.abs(difference) <= allowed + 1e-7).all())
    scale = 100 / np.maximum(np.abs(theirs.mean), 1e-6)
    text = "mean " + " ".join(f"{d:+.3f}" for d in difference * scale)
    text += f" % (se {(error * scale).max():.3f})  bins {100 * within:6.2f} %  rms z {np.sqrt((z[error_bins > floor] ** 2).mean()):.2f}"
    return mean_agrees and within >= BINS_WITHIN, text


def all_scenes():
    small = sorted(p for p in (ROOT / "tests/scenes").glob("*/*.xml") if p.parent.name != "shared")
    return small + sorted((ROOT / "scenes").glob("*/scene.xml"))


def without_motion(scene):
    """Definitions that put still shapes in the place of moving ones, which Mitsuba cannot read, if a scene offers that."""
    return {"motion": "still"} if '<default name="motion"' in scene.read_text(encoding="utf-8") else {}


def size_of_film(scene, size):
    """Definitions of resx and resy that make a project scene small, if it has such parameters."""
    if "<default name=\"resx\"" not in scene.read_text(encoding="utf-8"):
        return {}
    width, height = size.split("x")
    return {"resx": width, "resy": height}


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE")
    parser.add_argument("--warpath", default=str(ROOT / "build/warpath"), help="the binary")
    parser.add_argument("--variant", default="scalar_rgb", help="Mitsuba's variant")
    parser.add_argument("--spp", type=int, default=512, help="samples per pixel in all, for each renderer")
    parser.add_argument("--passes", type=int, default=16, help="independent passes of Mitsuba")
    parser.add_argument("--runs", type=int, default=16, help="independent runs of warpath")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", help="WxH of the film; needs parameters resx and resy in the scene for Mitsuba")
    parser.add_argument("--max-depth", type=int, help="for warpath, with --reference")
    parser.add_argument("-D", dest="defines", action="append", default=[], metavar="NAME=VALUE", help="a scene parameter")
    parser.add_argument("--only", help="a regular expression for the scenes' names")
    parser.add_argument("--reference", type=Path, help="an image to compare with, instead of rendering with Mitsuba")
    parser.add_argument("--reference-variance", type=Path, help="the variance of its mean, per pixel and channel")
    parser.add_argument("--cache", help="a folder that keeps Mitsuba's results for the next time")
    return parser.parse_args()


def compare(scene, options):
    """(agrees, text) for a scene."""
    defines = without_motion(scene) | dict(d.split("=", 1) for d in options.defines)
    if options.reference:
        rfilter = mi.load_file(str(scene), **defines).sensors()[0].film().rfilter()
        variance_file = options.reference_variance or options.reference.with_suffix(".variance.exr")
        theirs = estimate_from_variance(read_exr(options.reference), read_exr(variance_file), rfilter)
        height, width = read_exr(options.reference).shape[:2]
        options.size = f"{width}x{height}"
    else:
        if options.size or scene.is_relative_to(ROOT / "scenes"):
            defines |= size_of_film(scene, options.size or "160x90")
        theirs = cached(render_with_mitsuba, scene, options, defines)
    ours = render_with_warpath(scene, options, defines)
    return judge(ours, theirs)


def main():
    options = parse_options()
    mi.set_variant(options.variant if not options.reference else "scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    scenes = [s.resolve() for s in options.scenes] or all_scenes()
    failed = 0
    count = 0
    for scene in scenes:
        name = "/".join(scene.with_suffix("").parts[-2:])
        if options.only and not re.search(options.only, name):
            continue
        count += 1
        try:
            agrees, text = compare(scene, options)
        except (RuntimeError, OSError, ValueError) as error:
            agrees, text = False, " ".join(str(error).split())
        failed += not agrees
        print(f"{'ok  ' if agrees else 'FAIL'}  {name:42s}  {text}", flush=True)
    print(f"{count - failed} passed, {failed} failed")
    return 1 if failed or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
