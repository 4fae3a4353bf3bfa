"""Experiments of the paper on scenes that are written for this project."""

import math

from curves import error_charts
from pictures import densities_of, images_of, side_by_side, stacked, write_png
from plot import line_chart
from tables import column, comparison_table, gain, mean, of_method, rows_of, write_table
from tool import compare, crop, folder_of, own_scene, render_reference, train

FILM = {"size": "320x180", "max_depth": 6}
WARPS_4D = ["kdtree:film+bounce1", "realnvp:film+bounce1"]


def coins(epps=(1, 4, 64)):
    """Rings and coins: caustics. The error falls as the training set grows, epp x 100 x 100 examples, epp 1, 4 and 64."""
    scene, options = own_scene("coins"), {**FILM, "spp": 128, "runs": 5}
    against = render_reference("coins", scene, 2048, "kdtree:film+bounce1", epp=64, **FILM)
    base = compare("coins/baselines", scene, ["none", "uniform:film+bounce1"], **options, **against)
    table, lines, everything = comparison_table(base), {}, list(base)
    for epp in epps:
        results = compare(f"coins/epp-{epp}", scene, WARPS_4D, **options, examples=epp * 100 * 100, **against)
        table += rows_of(results, base, f"epp-{epp}")
        for method in WARPS_4D:
            lines.setdefault(method, []).append((epp, *gain(of_method(base, "none"), of_method(results, method), "mse")))
        everything += [{**run, "method": f"{run['method']}, epp-{epp}"} for run in results if run["family"] == "realnvp"]
    folder = folder_of("coins")
    write_table(folder, table)
    line_chart(folder / "gain.svg", "training set, epp x 100 x 100", "gain in MSE over plain path tracing", lines, rule=1)
    error_charts(folder, everything)
    close_up = {"exposure": 1.0, "crop": (0.10, 0.18, 0.42, 0.50), "zoom": 2}
    pictures = images_of(folder / "baselines", ["none"], **close_up)
    pictures[1:1] = images_of(folder / f"epp-{epps[-1]}", WARPS_4D, **close_up)[:-1]
    write_png(folder / "close-ups.png", stacked([side_by_side(pictures[:2]), side_by_side(pictures[2:])]))


def billiards():
    """A break shot with balls in motion, epp-16: 4D beats plain path tracing; in 3D (film and time), where the samples fall."""
    scene, options = own_scene("billiards"), {**FILM, "spp": 128, "runs": 5, "epp": 16}
    against = render_reference("billiards", scene, 2048, "kdtree:film+bounce1", epp=64, **FILM)
    blurred = ["kdtree:film+time", "realnvp:film+time"]
    methods = ["none", "uniform:film+bounce1", *WARPS_4D, "uniform:film+time", *blurred]
    results = compare("billiards", scene, methods, **options, **against)
    folder = folder_of("billiards")
    write_table(folder, comparison_table(results))
    error_charts(folder, results)
    write_png(folder / "images.png", stacked([side_by_side(strip) for strip in pairs(images_of(folder, ["none", *WARPS_4D]))]))
    # The white ball's streak alone, where the place on the film depends on time: the true density, kd-tree, Real NVP.
    compare("billiards/streak", scene, blurred, **{**options, "runs": 1, "spp": 1}, reference_spp=8, **crop(FILM, 0.08, 0.50, 0.31, 0.29))
    true_and_learned = [densities_of(folder / "streak", blurred, *axes) for axes in (("film.x", "time"), ("film.x", "film.y"))]
    write_png(folder / "densities.png", stacked([side_by_side(strip) for strip in true_and_learned]))


def pairs(pictures):
    return [pictures[k : k + 2] for k in range(0, len(pictures), 2)]


def gallery():
    """93 lights, most of them hidden from most places: the choice of light warped, against even choice and choice by power.

    Twice: with direct light alone, as in the paper, and with five bounces. `none, by power` is plain path tracing that chooses lights
    in proportion to their power.
    """
    scene = own_scene("gallery")
    dims = ["film+bounce1.light", "film+bounce1.light+bounce1.light_uv"]
    methods = ["none", *(f"{family}:{d}" for d in dims for family in ("uniform", "kdtree", "realnvp"))]
    for name, depth in (("direct", 2), ("all", 6)):
        label, options = f"gallery/{name}", {**FILM, "max_depth": depth}
        measure = {"spp": 128, "runs": 5, **render_reference(label, scene, 4096, "kdtree:film+bounce1.light", epp=64, **options)}
        results = compare(label, scene, methods, **options, **measure, epp=16)
        by_power = compare(f"{label}/by-power", scene, ["none"], **options, **measure, defines={"lights": "power"})
        results += [{**run, "method": "none, by power"} for run in by_power]
        folder = folder_of(label)
        write_table(folder, comparison_table(results))
        error_charts(folder, results)
        shown = images_of(folder, ["none", f"kdtree:{dims[0]}", f"realnvp:{dims[0]}"])
        write_png(folder / "images.png", stacked([side_by_side(strip) for strip in pairs(shown)]))


def alpha(alphas=(1.5, 2, 4, 8, 16, 32, 64)):
    """Candidates for each resampled example, 1.5 to 64, on the break shot: what more of them cost and gain; the knee.

    The number of examples and of training steps is the same, so only their quality differs. Training of a single step shows what
    resampling alone takes.
    """
    scene, options = own_scene("billiards"), {"size": "160x90", "max_depth": 6}
    measure = {"spp": 32, "runs": 8, **render_reference("alpha", scene, 2048, "kdtree:film+bounce1", epp=16, **options)}
    methods = ["uniform:film+bounce1", "realnvp:film+bounce1"]
    table = ["| α | candidates | candidates s | resampling s | gain over uniform | ± |", "|---|---|---|---|---|---|"]
    line, times = [], []
    for a in alphas:
        results = compare(f"alpha/{a:g}", scene, methods, **options, **measure, alpha=a, epp=2, max_steps=500)
        single = compare(f"alpha/{a:g}/resampling", scene, methods[1:], **options, **{**measure, "spp": 1}, alpha=a, epp=2, max_steps=1)
        runs = of_method(results, methods[1])
        gained, error = gain(of_method(results, methods[0]), runs, "mse")
        gathering, resampling = mean(column(runs, "candidate_seconds")), mean(column(single, "train_seconds"))
        line.append((a, gained, error))
        times.append((a, gathering + resampling))
        table.append(f"| {a:g} | {runs[0]['candidates']} | {gathering:.2f} | {resampling:.2f} | {gained:.2f} | {error:.2f} |")
    folder = folder_of("alpha")
    write_table(folder, table)
    line_chart(folder / "gain.svg", "α, candidates for each example", "gain in MSE over uniform", {"realnvp, 4D": line})
    line_chart(folder / "time.svg", "α, candidates for each example", "seconds", {"candidates and resampling": times}, log_y=True)


def reuse(steps=(25, 50, 100, 200, 400, 800)):
    """Weights trained in one view reused for a camera turned by 10, 45 and 90 degrees: loss and gain over training, and how much sooner."""
    scene, options = own_scene("study"), {"size": "160x90", "max_depth": 8}
    warp = "realnvp:film+bounce1"
    trained, _, _ = train("reuse", scene, warp, **options, epp=8)
    table = ["| turned by | gain from scratch, all steps | steps to reach it from scratch | from reused weights | sooner |", "|---|---|---|---|---|"]
    folder = folder_of("reuse")
    for angle in (10, 45, 90):
        turned = {**options, "defines": {"turn": angle}}
        measure = {"spp": 32, "runs": 3, **render_reference(f"reuse/{angle}", scene, 4096, objective="mse", **turned)}
        base = compare(f"reuse/{angle}/uniform", scene, ["uniform:film+bounce1"], **turned, **measure)
        gains, losses = {}, {}
        for start, init in (("from scratch", {}), ("reused weights", {"init": trained})):
            for n in steps:
                results = compare(f"reuse/{angle}/{start.replace(' ', '-')}-{n}", scene, [warp], **turned, **measure, epp=8, max_steps=n, **init)
                gains.setdefault(start, []).append((n, *gain(base, results, "mse")))
            losses[start] = [(p["seconds"], p["held_out"]) for p in results[0]["training_curve"]]
        line_chart(folder / f"gain-{angle}.svg", "training steps", "gain in MSE over uniform", gains, rule=1)
        line_chart(folder / f"loss-{angle}.svg", "seconds of training", "held-out loss", losses)
        table.append(f"| {angle}° | " + " | ".join(sooner(*gains.values())) + " |")
    write_table(folder, table)


def sooner(scratch, reused):
    """Cells: the last gain from scratch, where each line first comes within 3 % of it, and the ratio of both."""
    goal = 0.97 * scratch[-1][1]
    first, second = steps_to(scratch, goal), steps_to(reused, goal)
    cells = [f"{scratch[-1][1]:.2f} ± {scratch[-1][2]:.2f}", f"{first:.0f}"]
    if math.isinf(second):
        return [*cells, "not reached", ""]
    at_once = second <= reused[0][0]
    return [*cells, f"{'at most ' if at_once else ''}{second:.0f}", f"{'at least ' if at_once else ''}{first / second:.1f} ×"]


def steps_to(line, goal):
    """Steps after which a gain is reached for the first time, between two points by the logarithm; infinite if it never is."""
    before = None
    for steps, gained, _ in line:
        if gained >= goal:
            if before is None:
                return steps
            share = (goal - before[1]) / (gained - before[1])
            return before[0] * (steps / before[0]) ** share
        before = (steps, gained)
    return math.inf


ALL = (coins, billiards, gallery, alpha, reuse)
