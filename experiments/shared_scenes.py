"""Experiments on the Country Kitchen and the White Room, which are read from WARPATH_SCENES."""

from curves import error_charts
from pictures import write_comparison
from plot import line_chart
from records import write_record
from tables import gain, of_method, rows_of
from tool import compare, folder_of, own_scene, peak_memory, shared_scene, stored_reference, train

FILM = {"size": "320x180", "max_depth": 8}
PAPER = {**FILM, "spp": 128, "epp": 16, "runs": 3}
UNIFORM, KDTREE, REALNVP = WARPS_4D = ["uniform:film+bounce1", "kdtree:film+bounce1", "realnvp:film+bounce1"]
LOBE_5D = [f"{family}:film+bounce1.lobe+bounce1" for family in ("uniform", "realnvp")]
DEEPER = [f"{family}:film+bounce1+{more}" for more in ("bounce2", "bounce2+bounce3") for family in ("uniform", "realnvp")]
BOTH = ("country-kitchen", "white-room")
TWELVE = "film+" + "+".join(f"bounce{k}" for k in range(1, 6))
#: Gains in MSE over plain path tracing on the Country Kitchen [ZZ19].
PUBLISHED = {KDTREE: 1.82, REALNVP: 2.36, DEEPER[1]: 2.33, DEEPER[3]: 1.96}
#: The kd-tree of Guo et al. [GBBE18]: cells split in the middle, dimensions in turn, densities by the mean.
AS_PUBLISHED = {"kdtree_split": "cyclic", "kdtree_target": "mean"}


def reference(name):
    """The stored one, rendered by Mitsuba 3 at the depth of PAPER, or else one of warpath's own."""
    return stored_reference(f"{name}-d8") or {"reference_spp": 2048}


def beside_published(rows):
    return [{**row, **({"published": PUBLISHED[row["method"]]} if row["method"] in PUBLISHED else {})} for row in rows]


def first_claim():
    """The paper's first claim: Real NVP in 4D beats the kd-tree as published, at equal samples, epp-16, 128 spp."""
    tables = {}
    for name in BOTH:
        scene, against = shared_scene(name), reference(name)
        results = compare(f"first-claim/{name}", scene, ["none", UNIFORM, REALNVP], **PAPER, **against)
        published = compare(f"first-claim/{name}/kdtree", scene, [KDTREE], **PAPER, **against, **AS_PUBLISHED)
        rows = rows_of(results) + rows_of(published, results, "as published")
        tables[name] = beside_published(rows) if name == "country-kitchen" else rows
    write_record("first-claim", tables, PAPER)


def equal_time():
    """A minute for each method, everything included: joint warps, and the field for either error."""
    tables = {}
    for name in BOTH:
        scene, options = shared_scene(name), {**FILM, "time": 60, "runs": 3, **reference(name)}
        results = compare(f"equal-time/{name}", scene, ["none", KDTREE, REALNVP], **options, epp=16)
        tables[name] = rows_of(results)
        for objective in ("mse", "relmse"):
            field = compare(f"equal-time/{name}/{objective}", scene, ["field"], **options, objective=objective)
            tables[name] += rows_of(field, results, f"`--objective {objective}`")
    write_record("equal-time", tables, {**FILM, "time": 60, "epp": 16, "runs": 3})


def kitchen():
    """Country Kitchen, epp-16, 128 spp: plain path tracing, kd-tree, Real NVP in 4D, 5D, 6D and 8D."""
    methods = ["none", *WARPS_4D, *LOBE_5D, *DEEPER]
    results = compare("kitchen", shared_scene("country-kitchen"), methods, **PAPER, **reference("country-kitchen"))
    write_record("kitchen", {"country-kitchen": beside_published(rows_of(results))}, PAPER)


def white_room():
    """The White Room, the same in 4D and 5D."""
    results = compare("white-room", shared_scene("white-room"), ["none", *WARPS_4D, *LOBE_5D], **PAPER, **reference("white-room"))
    write_record("white-room", {"white-room": rows_of(results)}, PAPER)


def white_room_epp():
    """More training examples, epp 1, 4, 16 and 64: what each gains on the White Room."""
    scene, options, lines = shared_scene("white-room"), {**FILM, "spp": 64, "runs": 3, **reference("white-room")}, {}
    base = compare("white-room-epp/baselines", scene, ["none", UNIFORM], **options)
    rows = rows_of(base)
    for epp in (1, 4, 16, 64):
        results = compare(f"white-room-epp/{epp}", scene, [KDTREE, REALNVP], epp=epp, **options)
        rows += rows_of(results, base, f"epp-{epp}")
        for method in (KDTREE, REALNVP):
            lines.setdefault(method, []).append((epp, *gain(of_method(base, "none"), of_method(results, method), "mse")))
    write_record("white-room-epp", {"white-room": rows}, options)
    line_chart(folder_of("white-room-epp") / "gain.svg", "training set, epp", "gain in MSE over plain path tracing", lines, rule=1)


def error_curves():
    """Error over samples and over CPU time on both scenes, with error bars over the seeds; the field too, which learns while it renders."""
    tables, options = {}, {**PAPER, "spp": 64, "objective": "mse"}
    for name in BOTH:
        results = compare(f"error-curves/{name}", shared_scene(name), ["none", *WARPS_4D, "field"], **options, **reference(name))
        folder = folder_of(f"error-curves/{name}")
        tables[name] = rows_of(results)
        error_charts(folder, results)
        write_comparison(folder, ["none", KDTREE, REALNVP])
    write_record("error-curves", tables, options)


def published_realnvp():
    """Real NVP trained as published: separate networks, no encoding, batch normalisation, maximum likelihood."""
    tables = {}
    for name in BOTH:
        results = compare(f"published-realnvp/{name}", shared_scene(name), ["none", UNIFORM, REALNVP], **PAPER, **reference(name),
                          loss="likelihood", networks="separate", encoding_bins=0, masks="alternating", bn="batch",
                          couplings=8, width=64, rate=1e-3, jitter=0)  # fmt: skip
        tables[name] = rows_of(results)
    write_record("published-realnvp", tables, PAPER)


def training_time():
    """MSE gain over training time on the Country Kitchen, one run a point: Real NVP by steps, kd-tree by candidates."""
    scene, measure = shared_scene("country-kitchen"), {**FILM, "spp": 64, **reference("country-kitchen")}
    base = compare("training-time/baselines", scene, ["none", UNIFORM], **measure)
    budgets = [("realnvp", f"{n} steps", {"max_steps": n}) for n in (50, 150, 400, 1000, 3000)]
    budgets += [("kdtree", f"epp-{k}", {"epp": k}) for k in (0.5, 2, 8, 16, 64)]
    lines, rows = {"realnvp": [], "kdtree": []}, []
    for family, budget, training in budgets:
        label = f"training-time/{family}-{budget.replace(' ', '-')}"
        warp, seconds, _ = train(label, scene, f"{family}:film+bounce1", **FILM, **training)
        gained, _ = gain(of_method(base, "none"), compare(label, scene, [warp], **measure), "mse")
        lines[family].append((seconds, gained))
        rows.append({"method": f"{family}:film+bounce1", "label": budget, "train_cpu_seconds": seconds, "mse_gain": gained})
    write_record("training-time", {"country-kitchen": rows}, measure)
    axes = "CPU seconds of training, candidates included", "gain in MSE over plain path tracing"
    line_chart(folder_of("training-time") / "gain.svg", *axes, lines, rule=1)


def twelve_dims(epps=(1, 4, 16, 64, 256)):
    """12D on the kitchen (film and five bounces) with growing training sets: gain, time, and the memory that epp-4096 takes.

    epp-4096 has 131 M examples from 1.05 G candidates, an hour and a half of CPU time for these alone. So its cost is told from what a
    candidate costs, and its memory is measured where paths are cheap: as many examples, chunk by chunk from as many candidates.
    """
    scene, options = shared_scene("country-kitchen"), {**FILM, "spp": 32, "runs": 1, **reference("country-kitchen")}
    uniform = f"uniform:{TWELVE}"
    base = compare("twelve-dims/baselines", scene, ["none", uniform], **options)
    rows = [{"training set": f"`{name.partition(':')[0]}`", "mse_gain": gain(of_method(base, "none"), of_method(base, name), "mse")[0],
             "mse_over_uniform": gain(of_method(base, uniform), of_method(base, name), "mse")[0]} for name in ("none", uniform)]  # fmt: skip
    line = []
    for epp in epps:
        label = f"twelve-dims/epp-{epp}"
        results = compare(label, scene, [f"realnvp:{TWELVE}"], epp=epp, **options)
        (row,), (run,) = rows_of(results, base), results
        line.append((epp, row["mse_gain"][0]))
        cost = run["candidate_cpu_seconds"] / run["candidates"]
        rows.append({
            "training set": f"epp-{epp}",
            "candidates": run["candidates"],
            **{key: row[key][0] for key in ("candidate_cpu_seconds", "train_cpu_seconds", "mse_gain", "mse_over_uniform", "mse_gain_by_cost")},
            "peak_memory": round(peak_memory(label, "compare") / 1e6),
            "held_out": min(point["held_out"] for point in run["training_curve"]),
        })  # fmt: skip
    _, _, memory = train("twelve-dims/memory", own_scene("box"), f"realnvp:{TWELVE}", size="64x48", max_depth=2,
                         examples=4096 * 200 * 160, alpha=1, max_steps=100)  # fmt: skip
    count = 8 * 4096 * 200 * 160
    rows.append({"training set": "epp-4096, not trained", "candidates": count, "candidate_cpu_seconds": count * cost,
                 "peak_memory": round(memory / 1e6)})  # fmt: skip
    write_record("twelve-dims", {"country-kitchen": rows}, options)
    line_chart(folder_of("twelve-dims") / "gain.svg", "training set, epp", "gain in MSE over plain path tracing", {"realnvp, 12D": line}, rule=1)


ALL = (first_claim, equal_time, kitchen, white_room, white_room_epp, error_curves, published_realnvp, training_time, twelve_dims)
