"""Small versions of every claim, which check that it points the right way.

Each claim compares two ways of doing the same over SEEDS seeds, and holds if the mean advantage of one of them is positive at the level
CHANCE of a one-sided t-test. So a method that has no advantage passes a claim once in twenty, and all claims about it far more rarely.
Seeds are fixed: the outcome changes only with the code and the instruction set. Sizes were chosen so that sound methods hold all claims
with these seeds; others are tried with --seed.

Advantages are differences of logarithms of the errors of one seed (the reference's own noise not subtracted, so that they exist) or of
losses. Bulbs are larger here than in the scenes by default, so that fewer samples suffice.
"""

import math
import shutil
import time

from own_scenes import SHARE
from significance import chance_of_mean
from tables import column, mean, of_method
from tool import SETTINGS, compare, own_scene, render_reference, train

SEEDS = 6
CHANCE = 0.05
FILM_4D = "film+bounce1"
FILM_8D = "film+bounce1+bounce2+bounce3"
FILM_12D = FILM_8D + "+bounce4+bounce5"
LIGHT = "film+bounce1.light"
NETWORK = {"couplings": 8, "max_steps": 200}


def advantage(worse, better, key="mse_raw"):
    """By how much the errors of `better` are below those of `worse`, as logarithms, seed by seed."""
    return [math.log(a / b) for a, b in zip(column(worse, key), column(better, key))]


def over(results, better, worse, key="mse_raw"):
    return advantage(of_method(results, worse), of_method(results, better), key)


def dimensions():
    """In 4D, 8D and 12D Real NVP beats random numbers; in 4D it and the kd-tree beat plain path tracing."""
    scene, film = own_scene("box"), {"size": "64x48", "max_depth": 6}
    measure = {"runs": SEEDS, "spp": 48, **render_reference("quick/box", scene, 1024, **film)}
    methods = ["none", f"kdtree:{FILM_4D}", *(f"{family}:{d}" for d in (FILM_4D, FILM_8D, FILM_12D) for family in ("uniform", "realnvp"))]
    results = compare("quick/dimensions", scene, methods, **film, **measure, examples=20000, **NETWORK)
    for name, d in (("4D", FILM_4D), ("8D", FILM_8D), ("12D", FILM_12D)):
        yield f"realnvp {name} beats uniform", over(results, f"realnvp:{d}", f"uniform:{d}")
    yield "realnvp 4D beats none", over(results, f"realnvp:{FILM_4D}", "none")
    yield "kdtree 4D beats none", over(results, f"kdtree:{FILM_4D}", "none")
    resampled = {}
    for examples, alpha in ((10000, 16), (10000, 1.5), (1000, 16)):
        resampled[examples, alpha] = compare(f"quick/alpha-{examples}-{alpha:g}", scene, [f"realnvp:{FILM_4D}"], **film, **measure,
                                             examples=examples, alpha=alpha, **NETWORK)  # fmt: skip
    yield "more candidates for each example are better", advantage(resampled[10000, 1.5], resampled[10000, 16])
    yield "more examples are better", advantage(resampled[1000, 16], resampled[10000, 16])
    field = compare("quick/field", scene, ["none", "field"], **film, **measure, objective="relmse")
    yield "field beats none in relMSE", over(field, "field", "none", "relmse_raw")


def reuse():
    """Weights trained in one view teach a camera turned by 10 degrees sooner: after 20 steps they are better than new ones."""
    scene, film = own_scene("box"), {"size": "64x48", "max_depth": 6}
    weights, _, _ = train("quick/reuse", scene, f"realnvp:{FILM_4D}", **film, examples=20000, **NETWORK)
    turned = {**film, "defines": {"turn": 10}}
    measure = {"runs": SEEDS, "spp": 48, **render_reference("quick/reuse", scene, 512, **turned)}
    short = {**turned, **measure, "examples": 20000, **NETWORK, "max_steps": 20}
    new, reused = (compare(f"quick/reuse-{name}", scene, [f"realnvp:{FILM_4D}"], **short, **init)
                   for name, init in (("new", {}), ("reused", {"init": weights})))  # fmt: skip
    loss = [[run["training_curve"][-1]["held_out"] for run in runs] for runs in (new, reused)]
    yield "reuse, turned by 10 degrees: lower loss after 20 steps", [a - b for a, b in zip(*loss)]
    yield "reuse, turned by 10 degrees: lower error after 20 steps", advantage(new, reused)


def coins():
    """Caustics: the kd-tree beats plain path tracing and random numbers, the more examples the better."""
    scene, film = own_scene("coins"), {"size": "64x36", "max_depth": 4, "defines": {"bulb": 7}}
    measure = {"runs": SEEDS, "spp": 96, **render_reference("quick/coins", scene, 512, f"kdtree:{FILM_4D}", examples=40000, **film)}
    tree = f"kdtree:{FILM_4D}"
    base = compare("quick/coins", scene, ["none", f"uniform:{FILM_4D}"], **film, **measure)
    few, many = (compare(f"quick/coins-{n}", scene, [tree], **film, **measure, examples=n) for n in (2500, 40000))
    yield "coins: kdtree 4D beats none", advantage(of_method(base, "none"), many)
    yield "coins: kdtree 4D beats uniform", advantage(of_method(base, f"uniform:{FILM_4D}"), many)
    yield "coins: more examples are better", advantage(few, many)


def billiards():
    """Balls in motion: warps of film and first bounce, and of film and time, beat random numbers and plain path tracing."""
    scene, film = own_scene("billiards"), {"size": "64x36", "max_depth": 4, "defines": {"bulb": 0.05}}
    measure = {"runs": SEEDS, "spp": 96, **render_reference("quick/billiards", scene, 512, f"kdtree:{FILM_4D}", examples=40000, **film)}
    dims = (FILM_4D, "film+time")
    methods = ["none", *(f"{family}:{d}" for d in dims for family in ("uniform", "kdtree"))]
    results = compare("quick/billiards", scene, methods, **film, **measure, examples=30000)
    network = compare("quick/billiards-realnvp", scene, [f"realnvp:{FILM_4D}"], **film, **measure, examples=60000, max_steps=250)
    for d in dims:
        yield f"billiards: kdtree {d} beats uniform", over(results, f"kdtree:{d}", f"uniform:{d}")
        yield f"billiards: kdtree {d} beats none", over(results, f"kdtree:{d}", "none")
    yield "billiards: realnvp 4D beats uniform", advantage(of_method(results, f"uniform:{FILM_4D}"), network)


def gallery():
    """93 lights: learned choices of light beat choosing at random."""
    scene, film = own_scene("gallery"), {"size": "64x36", "max_depth": 2}
    measure = {"runs": SEEDS, "spp": 512, **render_reference("quick/gallery", scene, 4096, f"kdtree:{LIGHT}", examples=80000, **film)}
    methods = [f"{family}:{LIGHT}" for family in ("uniform", "kdtree", "realnvp")]
    results = compare("quick/gallery", scene, methods, **film, **measure, examples=30000, **SHARE, **NETWORK)
    yield "gallery: kdtree's choice of light beats uniform in relMSE", over(results, methods[1], methods[0], "relmse_raw")
    yield "gallery: realnvp's choice of light beats uniform in relMSE", over(results, methods[2], methods[0], "relmse_raw")


def memory():
    """A candidate costs 4 bytes, however many numbers it has."""
    scene, film = own_scene("box"), {"size": "64x48", "max_depth": 1}
    counts = (20_000_000, 30_000_000)  # so many that nothing else sets the peak
    training = {"examples": 10000, "couplings": 1, "max_steps": 1}
    peaks = [train("quick/memory", scene, f"realnvp:{FILM_12D}", **film, **training, alpha=n / 10000)[2] for n in counts]
    bytes_each = (peaks[1] - peaks[0]) / (counts[1] - counts[0])
    yield f"a candidate takes {bytes_each:.1f} bytes, 3 to 5", 3 < bytes_each < 5


CLAIMS = (dimensions, reuse, coins, billiards, gallery, memory)


def main(only):
    """Prints a line for each claim; 1 if any does not hold."""
    shutil.rmtree(SETTINGS.out / "quick", ignore_errors=True)  # claims are about this build
    start = time.monotonic()
    failed = count = 0
    for group in CLAIMS:
        if only not in group.__name__:
            continue
        begin = time.monotonic()
        for name, values in group():
            if isinstance(values, bool):
                holds, text = values, ""
            else:
                chance = chance_of_mean(values)
                holds, text = chance < CHANCE, f"mean {mean(values):+.3f}, by chance {chance:.1e}"
            count += 1
            failed += not holds
            print(f"{'ok  ' if holds else 'FAIL'}  {name:52} {text}", flush=True)
        print(f"      {group.__name__}: {time.monotonic() - begin:.0f} s", flush=True)
    print(f"{count - failed} of {count} claims hold, level {CHANCE:g}, {SEEDS} seeds; {time.monotonic() - start:.0f} s in {SETTINGS.out / 'quick'}")
    return 1 if failed or count == 0 else 0
