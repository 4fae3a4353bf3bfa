"""Experiments with the field, which learns while it renders."""

from curves import error_charts
from shared_scenes import BOTH, reference
from tables import column, comparison_table, gain, mean, of_method, rows_of, write_table
from tool import compare, folder_of, own_scene, render_reference, shared_scene, train

FIRST_HIT = "bounce1.lobe+bounce1"
ALL_OF_FIRST_HIT = f"bounce1.light+bounce1.light_uv+{FIRST_HIT}"


def field_at(label, methods, **options):
    """Both shared scenes, samples placed for either error."""
    for name in BOTH:
        for objective in ("mse", "relmse"):
            place = f"{label}/{name}-{objective}"
            results = compare(place, shared_scene(name), methods, size="320x180", max_depth=8, runs=3, objective=objective,
                              sampler="sobol", **options, **reference(name))  # fmt: skip
            write_table(folder_of(place), comparison_table(results))
            error_charts(folder_of(place), results)


def field_samples():
    """The field at 128 and 512 spp, all passes counted; uniform:bounce1 shows what placing the samples gains alone."""
    field_at("field-128", ["none", "uniform:bounce1", "field"], spp=128)
    field_at("field-512", ["none", "field"], spp=512)


def field_time():
    """The field for a minute and auto for half of one, against plain path tracing at equal time, everything included; 128 and 512 spp are on the way."""
    field_at("field-60s", ["none", "field"], time=60)
    field_at("auto-30s", ["none", "auto"], time=30)


def references_of_own_scenes():
    """Name, scene, and options of each of the project's scenes, with a long reference; by the kd-tree where the field misses the light."""
    small = {"size": "160x90", "max_depth": 6}
    films = {"box": small, "study": small, "ajar": {"size": "160x90"}, "billiards": small, "gallery": small}
    for name, film in films.items():
        yield name, own_scene(name), {**film, **render_reference(f"references/{name}", own_scene(name), 2048, objective="relmse", **film)}
    film = {**small, "max_depth": 4, "defines": {"bulb": 7}}
    against = render_reference("references/coins", own_scene("coins"), 2048, "kdtree:film+bounce1", examples=640000, uniform=0.3, **film)
    yield "coins", own_scene("coins"), {**film, **against}


def field_own_scenes():
    """The project's own scenes at 128 spp: field for either error, all samples counted, and the joint spline, whose candidates are not."""
    lines = ["| scene | field, MSE | field, relMSE | joint spline, MSE | relMSE |", "|" + "---|" * 5]
    for name, scene, options in references_of_own_scenes():
        def measure(objective, *methods):
            label = f"field-own-scenes/{name}-{objective}"
            return compare(label, scene, ["none", *methods], spp=128, epp=4, runs=3, objective=objective, sampler="independent", **options)

        joint = f"spline:film+{FIRST_HIT}"
        mse, relmse = measure("mse", "field", joint), measure("relmse", "field")
        cells = [(mse, "field", "mse"), (relmse, "field", "relmse"), (mse, joint, "mse"), (mse, joint, "relmse")]
        gains = ["{:.2f} ± {:.2f}".format(*gain(of_method(runs, "none"), of_method(runs, method), error)) for runs, method, error in cells]
        lines.append(f"| `scenes/{name}` | " + " | ".join(gains) + " |")
    write_table(folder_of("field-own-scenes"), lines)


#: Of Student's t with 9 degrees of freedom: one in twenty values is above.
T_OF_TEN_RUNS = 1.833


def auto_everywhere():
    """auto against plain path tracing on every scene, ten interleaved runs at equal time: where a warp does not pay, looking costs little."""
    lines = ["| scene | objective | none, error | auto, error | auto over none | upper bound, 95 % | what it chose |", "|" + "---|" * 7]
    scenes = [(name, shared_scene(name), {"size": "320x180", "max_depth": 8, **reference(name)}) for name in BOTH]
    scenes += references_of_own_scenes()
    for name, scene, options in scenes:
        for objective in ("mse", "relmse"):
            label = f"auto-everywhere/{name}-{objective}"
            runs = compare(label, scene, ["none", "auto"], time=5, runs=10, objective=objective, sampler="sobol", **options)
            none, auto = of_method(runs, "none"), of_method(runs, "auto")
            ratio, error = gain(auto, none, objective)
            means = (f"{mean(column(some, objective)):.4g}" for some in (none, auto))
            chosen = sorted({run["training_stopped"].split(";")[0] for run in auto})
            lines.append(f"| {name} | {objective} | {' | '.join(means)} | {ratio:.3f} ± {error:.3f} | {ratio + T_OF_TEN_RUNS * error:.3f} | {', '.join(chosen)} |")
    write_table(folder_of("auto-everywhere"), lines)


def door_ajar():
    """Light that comes through a door left ajar, at equal time, against a field's long reference."""
    scene, size = own_scene("ajar"), {"size": "160x90"}
    against = render_reference("door-ajar", scene, 2048, objective="relmse", **size)
    for objective in ("mse", "relmse"):
        label = f"door-ajar/{objective}"
        results = compare(label, scene, ["none", "field", "auto"], **size, time=10, runs=3, objective=objective, **against)
        write_table(folder_of(label), comparison_table(results))


def views():
    """A field trained in one view serves others: the camera of scenes/ajar turned by 10, 45 and 90 degrees."""
    scene, size = own_scene("ajar"), {"size": "160x90"}
    field, _, _ = train("views", scene, "field", **size, epp=8)
    for angle in (10, 45, 90):
        label, turned = f"views/{angle}", {**size, "defines": {"turn": angle}}
        against = render_reference(label, scene, 1024, objective="relmse", **turned)
        results = compare(label, scene, ["none", "field", field], **turned, spp=32, runs=5, **against)
        write_table(folder_of(label), comparison_table(results))


def conditional():
    """Warps of the first hit over a stratified film, for both objectives: kd-trees in tiles of it, spline flows, the field; chi-squared against KL."""
    for name in BOTH:
        place, scene = f"conditional/{name}", shared_scene(name)
        fixed = {"size": "320x180", "max_depth": 8, "spp": 128, "runs": 3, **reference(name)}
        base = compare(f"{place}/base", scene, ["none"], **fixed)
        table = comparison_table(base)
        warps = [f"kdtree:{FIRST_HIT}", f"kdtree:{ALL_OF_FIRST_HIT}", f"spline:{FIRST_HIT}", f"spline:{ALL_OF_FIRST_HIT}", f"field:{ALL_OF_FIRST_HIT}"]
        for objective in ("mse", "relmse"):
            table += rows_of(compare(f"{place}/{objective}", scene, warps, **fixed, objective=objective), base, f"for {objective}")
        likelihood = compare(f"{place}/likelihood", scene, [f"spline:{FIRST_HIT}"], **fixed, objective="mse", loss="likelihood")
        table += rows_of(likelihood, base, "for mse, KL")
        write_table(folder_of(place), table)


def ablation():
    """What each part brings at 64 spp: conditioning, later vertices, light choice, loss, lobe, Sobol' points, allocation, what passes teach."""
    for name in BOTH:
        place, scene = f"ablation/{name}", shared_scene(name)
        fixed = {"size": "320x180", "max_depth": 8, "spp": 64, "runs": 3, **reference(name)}
        base = compare(f"{place}/base", scene, ["none", "field", "neural"], **fixed, objective="relmse")
        table = comparison_table(base)

        def add(label, methods, **options):
            table.extend(rows_of(compare(f"{place}/{label}", scene, methods, **{**fixed, **options}), base, label))

        # The first hit's direction: one density for all pixels, one for each place, and one by a network.
        add("first-hit", [f"realnvp:{FIRST_HIT}", f"field:{FIRST_HIT}", f"neural:{FIRST_HIT}"], objective="relmse", epp=4)
        add("light-of-first-hit", ["field:bounce1.light+bounce1.light_uv"], objective="relmse")
        add("even-allocation", ["field"], objective="even")
        add("mse-allocation", ["field"], objective="mse")
        add("sobol", ["none", "field"], objective="relmse", sampler="sobol")
        # Trained beforehand on as many paths, which do not count.
        warp, _, _ = train(place, scene, "field", size="320x180", max_depth=8, examples=64 * 320 * 180 // 8)
        add("passes-do-not-count", [warp], objective="relmse")
        # Joint warps, whose candidates do not count.
        add("joint", [f"spline:film+{FIRST_HIT}", "spline:film+bounce1"], epp=4)
        add("joint-likelihood", [f"spline:film+{FIRST_HIT}"], epp=4, loss="likelihood")
        write_table(folder_of(place), table)


ALL = (field_samples, field_time, conditional, ablation, field_own_scenes, auto_everywhere, door_ajar, views)
