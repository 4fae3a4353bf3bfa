"""Experiments of the paper on scenes that are written for this project."""

from curves import error_charts
from pictures import densities_of, images_of, side_by_side, stacked, write_comparison, write_png
from plot import line_chart
from records import write_record
from shared_scenes import AS_PUBLISHED
from tables import gain, mean, measured, of_method, rows_of, standard_error
from tool import compare, crop, folder_of, own_scene, render_reference

FILM = {"size": "160x90", "max_depth": 6}
SIZES = {**FILM, "spp": 128, "runs": 5}
# Where a network misses a caustic, a highlight in motion or a light, its samples weigh up to 1 / this many times what a uniform one does.
SHARE = {"uniform_share": 0.3}
WARPS_4D = ["kdtree:film+bounce1", "realnvp:film+bounce1"]
#: Gains in MSE of Real NVP over plain path tracing on rings and coins, by the size of the training set [ZZ19].
PUBLISHED = {1: 1.35, 4: 1.63, 64: 1.84}


def coins(epps=(1, 4, 64)):
    """Rings and coins: caustics. The error falls as the training set grows, epp x 100 x 100 examples, epp 1, 4 and 64.

    The small sets are resampled from 64 candidates for each example: among eight of them there are too few that hit a caustic.
    """
    film = {**FILM, "max_depth": 4, "defines": {"bulb": 7}}
    scene, options = own_scene("coins"), {**SIZES, **film}
    against = render_reference("coins", scene, 1024, "kdtree:film+bounce1", examples=640000, **film, **SHARE)
    base = compare("coins/baselines", scene, ["none", "uniform:film+bounce1"], **options, **against)
    rows, lines, everything = rows_of(base), {}, list(base)
    for epp in epps:
        more = {"alpha": 64} if epp < 64 else {}
        results = compare(f"coins/epp-{epp}", scene, WARPS_4D, **options, **SHARE, examples=epp * 100 * 100, max_steps=600, **against, **more)
        rows += [{**row, **({"published": PUBLISHED[epp]} if row["method"] == WARPS_4D[1] else {})} for row in rows_of(results, base, f"epp-{epp}")]
        for method in WARPS_4D:
            lines.setdefault(method, []).append((epp, *gain(of_method(base, "none"), of_method(results, method), "mse")))
        everything += [{**run, "method": f"{run['method']}, epp-{epp}"} for run in results if run["family"] == "realnvp"]
    folder = folder_of("coins")
    write_record("coins", {"coins": rows}, {**options, **SHARE})
    line_chart(folder / "gain.svg", "training set, epp x 100 x 100", "gain in MSE over plain path tracing", lines, rule=1)
    error_charts(folder, everything)
    close_up = {"exposure": 0.1, "crop": (0.10, 0.18, 0.42, 0.50), "zoom": 5}
    pictures = images_of(folder / "baselines", ["none"], **close_up)
    pictures[1:1] = images_of(folder / f"epp-{epps[-1]}", WARPS_4D, **close_up)[:-1]
    write_png(folder / "close-ups.png", stacked([side_by_side(pictures[:2]), side_by_side(pictures[2:])]))


def billiards():
    """A break shot with balls in motion, epp-16: 4D beats plain path tracing; in 3D (film and time), where the samples fall."""
    scene, options = own_scene("billiards"), {**SIZES, **SHARE, "epp": 16}
    against = render_reference("billiards", scene, 512, "field", objective="mse", **FILM)
    blurred = ["kdtree:film+time", "realnvp:film+time"]
    methods = ["none", "uniform:film+bounce1", *WARPS_4D, "uniform:film+time", *blurred]
    results = compare("billiards", scene, methods, **options, **against)
    folder = folder_of("billiards")
    published = compare("billiards/published-kdtree", scene, ["kdtree:film+bounce1"], **options, **against, **AS_PUBLISHED)
    error_charts(folder, results)
    write_comparison(folder, ["none", *WARPS_4D], zoom=2)
    # The white ball's streak alone, where the place on the film depends on time: the true density, kd-tree, Real NVP.
    compare("billiards/streak", scene, blurred, **{**options, "runs": 1, "spp": 1}, reference_spp=8, **crop(FILM, 0.08, 0.50, 0.31, 0.29))
    true_and_learned = [densities_of(folder / "streak", blurred, *axes) for axes in (("film.x", "time"), ("film.x", "film.y"))]
    write_png(folder / "densities.png", stacked([side_by_side(strip) for strip in true_and_learned]))
    write_record("billiards", {"billiards": rows_of(results) + rows_of(published, results, "as published")}, options)


LIGHT = "film+bounce1.light"


def gallery():
    """93 lights, most of them hidden from most places, direct light: the choice of light warped, against even choice and choice by power."""
    light_choice("gallery", 2, [LIGHT, LIGHT + "+bounce1.light_uv"])


def gallery_all():
    """The same with five bounces."""
    light_choice("gallery-all", 6, [LIGHT])


def light_choice(label, depth, dims):
    """`none, by power` is plain path tracing that chooses lights in proportion to their power."""
    scene, film, methods = own_scene("gallery"), {**FILM, "max_depth": depth}, ["none"]
    methods += [f"{family}:{d}" for d in dims for family in ("uniform", "kdtree", "realnvp")]
    options = {**SIZES, **film, **render_reference(label, scene, 512, "field", objective="relmse", **film)}
    results = compare(label, scene, methods, **options, epp=16)
    by_power = compare(f"{label}/by-power", scene, ["none"], **options, defines={"lights": "power"})
    results += [{**run, "method": "none, by power"} for run in by_power]
    folder = folder_of(label)
    write_record(label, {"gallery": rows_of(results)}, {**SIZES, **film, "epp": 16})
    error_charts(folder, results)
    write_comparison(folder, ["none", f"kdtree:{LIGHT}", f"realnvp:{LIGHT}"], zoom=2)


def alpha(alphas=(1.5, 2, 4, 8, 16, 32, 64)):
    """Candidates for each resampled example, 1.5 to 64, on scenes/box: what more of them cost and gain; the knee.

    The number of examples and of training steps is the same, so only their quality differs.
    """
    scene, film = own_scene("box"), {**FILM, "size": "64x48"}
    measure = {**film, "spp": 64, "runs": 6, **render_reference("alpha", scene, 1024, "field", objective="mse", **film)}
    base = compare("alpha/baselines", scene, ["none", "uniform:film+bounce1"], **measure)
    rows, line, loss_line, times = [], [], [], []
    for a in alphas:
        runs = compare(f"alpha/{a:g}", scene, ["realnvp:film+bounce1"], **measure, alpha=a, examples=20000, max_steps=200)
        gained = gain(of_method(base, "uniform:film+bounce1"), runs, "mse")
        gathering = measured(runs, "candidate_cpu_seconds")
        resampling = mean([run["train_cpu_seconds"] - run["training_curve"][-1]["cpu_seconds"] for run in runs])
        losses = [run["training_curve"][-1]["held_out"] for run in runs]
        loss = [mean(losses), standard_error(losses)]
        line.append((a, *gained))
        loss_line.append((a, *loss))
        times.append((a, gathering[0] + resampling))
        rows.append({"α": f"{a:g}", "candidates": runs[0]["candidates"], "candidate_cpu_seconds": gathering, "resample_cpu_seconds": resampling,
                     "mse_over_uniform": gained, "held_out": loss})  # fmt: skip
    folder = folder_of("alpha")
    write_record("alpha", {"box": rows}, {**measure, "examples": 20000, "max_steps": 200})
    line_chart(folder / "gain.svg", "α, candidates for each example", "gain in MSE over uniform", {"realnvp, 4D": line})
    line_chart(folder / "loss.svg", "α, candidates for each example", "held-out loss, ln E[g / q]", {"realnvp, 4D": loss_line})
    line_chart(folder / "time.svg", "α, candidates for each example", "CPU seconds", {"candidates and resampling": times}, log_y=True)


ALL = (coins, billiards, gallery, gallery_all, alpha)
