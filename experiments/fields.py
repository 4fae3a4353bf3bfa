"""Experiments with the warps that learn while they render: the field, and those that are conditioned on the first hit."""

from curves import error_charts
from markdown import TITLES
from records import write_record
from reuse import by_training
from shared_scenes import BOTH, FILM, reference
from tables import gain, measured, methods_of, of_method, rows_of
from tool import compare, folder_of, own_scene, render_reference, shared_scene, train

FIRST_HIT = "bounce1.lobe+bounce1"
ALL_OF_FIRST_HIT = f"bounce1.light+bounce1.light_uv+{FIRST_HIT}"


def at_spp(results, spp):
    """The runs as they were after so many samples per pixel, by their error curves."""
    return [{**run, **next(point for point in run["error_curve"] if point["spp"] >= spp - 0.5)} for run in results]


def for_either_error(experiment, part, methods, **options):
    """Runs on both shared scenes with samples placed for either error, {scene: {objective: results}}."""
    found = {}
    for name in BOTH:
        for objective in ("mse", "relmse"):
            label = f"{experiment}/{part}/{name}-{objective}"
            results = compare(label, shared_scene(name), methods, **FILM, runs=3, objective=objective, sampler="sobol", **options, **reference(name))
            error_charts(folder_of(label), results)
            found.setdefault(name, {})[objective] = results
    return found


def gains_of(found, spp=None):
    """{scene: rows} of all but `none`, at the end or after so many samples per pixel, with how many samples `none` had."""
    tables = {name: [] for name in found}
    for name, by_objective in found.items():
        for objective, results in by_objective.items():
            then = at_spp(results, spp) if spp else results
            none = of_method(then, "none")
            for method in methods_of(then)[1:]:  # without `none`
                runs = of_method(then, method)
                row = {"method": method, "label": f"`--objective {objective}`", "runs": len(runs)}
                row |= {"spp": measured(runs, "spp"), "none_spp": measured(none, "spp")}
                row |= {key: measured(runs, key) for key in ("mse", "relmse")}
                row |= {f"{key}_gain": gain(none, runs, key) for key in ("mse", "relmse")}
                tables[name].append(row)
    return tables


def prefixed(prefix, tables):
    return {f"{prefix}-{name}": rows for name, rows in tables.items()}


def field_samples():
    """The field at 128 and 512 spp, all passes counted; uniform:bounce1 shows what placing the samples gains alone."""
    few = for_either_error("field-samples", "128", ["none", "uniform:bounce1", "field"], spp=128)
    many = for_either_error("field-samples", "512", ["none", "field"], spp=512)
    write_record("field-samples", {**prefixed("128", gains_of(few)), **prefixed("512", gains_of(many))}, {**FILM, "sampler": "sobol", "runs": 3})


def field_time():
    """The field for a minute against plain path tracing, everything included; 128 spp are on the way."""
    found = for_either_error("field-time", "60", ["none", "field"], time=60)
    tables = {**prefixed("128-spp", gains_of(found, 128)), **prefixed("60-s", gains_of(found))}
    write_record("field-time", tables, {**FILM, "time": 60, "sampler": "sobol", "runs": 3})


def auto_time():
    """auto for half a minute against plain path tracing, everything included."""
    found = for_either_error("auto-time", "30", ["none", "auto"], time=30)
    write_record("auto-time", gains_of(found), {**FILM, "time": 30, "sampler": "sobol", "runs": 3})


def references_of_own_scenes(experiment):
    """Name, scene, and options of each of the project's scenes, with a long reference; by the kd-tree where the field misses the light."""
    small = {"size": "160x90", "max_depth": 6}
    films = {"box": small, "study": small, "ajar": {"size": "160x90"}, "billiards": small, "gallery": small}
    for name, film in films.items():
        label = f"{experiment}/references/{name}"
        yield name, own_scene(name), {**film, **render_reference(label, own_scene(name), 2048, objective="relmse", **film)}
    film = {**small, "max_depth": 4, "defines": {"bulb": 7}}
    label = f"{experiment}/references/coins"
    kdtree = {"examples": 640000, "uniform_share": 0.3}
    yield "coins", own_scene("coins"), {**film, **render_reference(label, own_scene("coins"), 2048, "kdtree:film+bounce1", **kdtree, **film)}


def field_own_scenes():
    """The project's own scenes at 128 spp: field for either error, all samples counted, and the joint spline, whose candidates are not."""
    joint, rows = f"spline:film+{FIRST_HIT}", []
    for name, scene, options in references_of_own_scenes("field-own-scenes"):

        def measure(objective, methods, label=f"field-own-scenes/{name}", scene=scene, options=options, **more):
            return compare(f"{label}-{objective}", scene, methods, spp=128, runs=3, objective=objective, **options, **more)

        mse, relmse = measure("mse", ["none", "field", joint], epp=4), measure("relmse", ["none", "field"])
        cells = {"field, MSE gain": (mse, "field", "mse"), "field, relMSE gain": (relmse, "field", "relmse"),
                 "joint spline, MSE gain": (mse, joint, "mse"), "joint spline, relMSE gain": (mse, joint, "relmse")}  # fmt: skip
        rows.append({"scene": f"`scenes/{name}`", **{title: gain(of_method(runs, "none"), of_method(runs, method), error)
                                                     for title, (runs, method, error) in cells.items()}})  # fmt: skip
    write_record("field-own-scenes", {"scenes": rows}, {"spp": 128, "runs": 3})


#: Of Student's t with 9 degrees of freedom: one in twenty values is above.
T_OF_TEN_RUNS = 1.833


def auto_everywhere():
    """auto against plain path tracing on every scene, ten interleaved runs at equal time: where a warp does not pay, looking costs little."""
    rows = []
    scenes = [(name, shared_scene(name), {**FILM, **reference(name)}) for name in BOTH]
    scenes += references_of_own_scenes("auto-everywhere")
    for name, scene, options in scenes:
        row = {"scene": TITLES.get(name, f"`scenes/{name}`")}
        for objective, error in (("mse", "MSE"), ("relmse", "relMSE")):
            label = f"auto-everywhere/{name}-{objective}"
            runs = compare(label, scene, ["none", "auto"], time=5, runs=10, objective=objective, sampler="sobol", **options)
            auto = of_method(runs, "auto")
            ratio, spread = gain(auto, of_method(runs, "none"), objective)
            row[f"{error} of `auto` over `none`"] = [ratio, spread]
            row[f"{error}, at most"] = ratio + T_OF_TEN_RUNS * spread
            row[f"chosen for {error}"] = ", ".join(sorted({run["training_stopped"].split(";")[0] for run in auto}))
        rows.append(row)
    write_record("auto-everywhere", {"scenes": rows}, {"time": 5, "sampler": "sobol", "runs": 10})


def door_ajar():
    """Light that comes through a door left ajar, at equal time, against a field's long reference."""
    scene, size = own_scene("ajar"), {"size": "160x90"}
    against = render_reference("door-ajar", scene, 2048, objective="relmse", **size)
    rows = []
    for objective in ("mse", "relmse"):
        results = compare(f"door-ajar/{objective}", scene, ["none", "field", "auto"], **size, time=10, runs=3, objective=objective, **against)
        rows += [row for row in rows_of(results, label=f"`--objective {objective}`") if row["method"] != "none"]
    write_record("door-ajar", {"ajar": rows}, {**size, "time": 10, "runs": 3})


def views():
    """A field trained in one view serves others: the camera of scenes/ajar turned by 10, 45 and 90 degrees."""
    scene, size = own_scene("ajar"), {"size": "160x90"}
    field, _, _ = train("views", scene, "field", **size, epp=8)
    rows = []
    for angle in (10, 45, 90):
        label, turned = f"views/{angle}", {**size, "defines": {"turn": angle}}
        against = render_reference(label, scene, 1024, objective="relmse", **turned)
        results = compare(label, scene, ["none", "field", field], **turned, spp=32, runs=5, **against)
        rows.append(by_training(angle, results, of_method(results, "field"), of_method(results, str(field))))
    write_record("views", {"ajar": rows}, {**size, "spp": 32, "runs": 5})


def conditional():
    """Warps of the first hit over a stratified film, for both objectives: kd-trees in tiles of it, spline flows, the field.

    Chi-squared against KL.
    """
    tables, measure = {}, {**FILM, "spp": 128, "runs": 3}
    warps = [f"{family}:{dims}" for dims in (FIRST_HIT, ALL_OF_FIRST_HIT) for family in ("conditional-kdtree", "conditional-spline")]
    warps.append(f"field:{ALL_OF_FIRST_HIT}")
    for name in BOTH:
        place, scene, fixed = f"conditional/{name}", shared_scene(name), {**measure, **reference(name)}
        base = compare(f"{place}/base", scene, ["none"], **fixed)
        tables[name] = rows_of(base)
        for objective in ("mse", "relmse"):
            tables[name] += rows_of(compare(f"{place}/{objective}", scene, warps, **fixed, objective=objective), base, f"`--objective {objective}`")
        likelihood = compare(f"{place}/likelihood", scene, [f"conditional-spline:{FIRST_HIT}"], **fixed, objective="mse", loss="likelihood")
        tables[name] += rows_of(likelihood, base, "`--objective mse --loss likelihood`")
    write_record("conditional", tables, measure)


def ablation():
    """What each part brings at 64 spp: conditioning, later vertices, light choice, loss, lobe, Sobol' points, allocation, what passes teach."""
    tables, measure = {}, {**FILM, "spp": 64, "runs": 3}
    for name in BOTH:
        place, scene, fixed = f"ablation/{name}", shared_scene(name), {**measure, **reference(name)}
        base = compare(f"{place}/base", scene, ["none", "field"], **fixed, objective="relmse")
        rows = tables[name] = rows_of(base)

        def add(part, methods, label, rows=rows, base=base, place=place, scene=scene, fixed=fixed, **options):
            rows.extend(rows_of(compare(f"{place}/{part}", scene, methods, **fixed, **options), base, label))

        add("even-allocation", ["field"], "`--objective even`", objective="even")
        add("mse-allocation", ["field"], "`--objective mse`", objective="mse")
        add("sobol", ["none", "field"], "`--sampler sobol`", objective="relmse", sampler="sobol")
        # Trained beforehand on as many paths, which do not count.
        warp, _, _ = train(place, scene, "field", **FILM, examples=64 * 320 * 180 // 8)
        before = [{**run, "method": "field"} for run in compare(f"{place}/passes-do-not-count", scene, [warp], **fixed, objective="relmse")]
        rows += rows_of(before, base, "trained before on as many paths")
        # The first hit: its light; its direction with one density for all pixels, and with one for each place.
        add("light-of-first-hit", ["field:bounce1.light+bounce1.light_uv"], "", objective="relmse")
        add("first-hit", [f"realnvp:{FIRST_HIT}", f"field:{FIRST_HIT}"], "", objective="relmse", epp=4)
        # Joint warps, whose candidates do not count.
        add("joint", [f"spline:film+{FIRST_HIT}", "spline:film+bounce1"], "", epp=4)
        add("joint-likelihood", [f"spline:film+{FIRST_HIT}"], "`--loss likelihood`", epp=4, loss="likelihood")
    write_record("ablation", tables, measure)


ALL = (field_samples, field_time, auto_time, conditional, ablation, field_own_scenes, auto_everywhere, door_ajar, views)
