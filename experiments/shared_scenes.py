"""Experiments on the Country Kitchen and the White Room, which are read from WARPATH_SCENES."""

from curves import error_charts
from pictures import write_comparison
from plot import line_chart
from tables import column, comparison_table, gain, mean, of_method, rows_of, write_table
from tool import compare, folder_of, own_scene, peak_memory, shared_scene, stored_reference, train

PAPER = {"size": "320x180", "max_depth": 8, "spp": 128, "epp": 16, "runs": 3}
WARPS_4D = ["uniform:film+bounce1", "kdtree:film+bounce1", "realnvp:film+bounce1"]
LOBE_5D = [f"{family}:film+bounce1.lobe+bounce1" for family in ("uniform", "realnvp")]
DEEPER = [f"{family}:film+bounce1+{more}" for more in ("bounce2", "bounce2+bounce3") for family in ("uniform", "realnvp")]
BOTH = ("country-kitchen", "white-room")
TWELVE = "film+" + "+".join(f"bounce{k}" for k in range(1, 6))


def reference(name):
    """The stored one, rendered by Mitsuba 3 at the depth of PAPER, or else one of warpath's own."""
    return stored_reference(f"{name}-d8") or {"reference_spp": 2048}


def kitchen():
    """Country Kitchen, epp-16, 128 spp: plain path tracing, kd-tree, Real NVP in 4D, 5D, 6D and 8D."""
    methods = ["none", *WARPS_4D, *LOBE_5D, *DEEPER]
    results = compare("kitchen", shared_scene("country-kitchen"), methods, **PAPER, **reference("country-kitchen"))
    write_table(folder_of("kitchen"), comparison_table(results))


def white_room():
    """The White Room, the same in 4D and 5D."""
    results = compare("white-room", shared_scene("white-room"), ["none", *WARPS_4D, *LOBE_5D], **PAPER, **reference("white-room"))
    write_table(folder_of("white-room"), comparison_table(results))


def white_room_epp():
    """More training examples, epp 1, 4, 16 and 64: what each gains on the White Room."""
    scene, methods, options, lines = shared_scene("white-room"), WARPS_4D[1:], {**PAPER, "spp": 64, **reference("white-room")}, {}
    del options["epp"]
    base = compare("white-room-epp/baselines", scene, ["none", WARPS_4D[0]], **options)
    table = comparison_table(base)
    for epp in (1, 4, 16, 64):
        results = compare(f"white-room-epp/{epp}", scene, methods, epp=epp, **options)
        table += rows_of(results, base, f"epp-{epp}")
        for method in methods:
            lines.setdefault(method, []).append((epp, *gain(of_method(base, "none"), of_method(results, method), "mse")))
    folder = folder_of("white-room-epp")
    write_table(folder, table)
    line_chart(folder / "gain.svg", "training set, epp", "gain in MSE over plain path tracing", lines, rule=1)


def error_curves():
    """Error over samples and over CPU time on both scenes, with error bars over the seeds; the field too, which learns while it renders."""
    for name in BOTH:
        results = compare(f"error-curves/{name}", shared_scene(name), ["none", *WARPS_4D, "field"], **{**PAPER, "spp": 64}, objective="mse", **reference(name))
        folder = folder_of(f"error-curves/{name}")
        write_table(folder, comparison_table(results))
        error_charts(folder, results)
        write_comparison(folder, ["none", *WARPS_4D[1:]])


def published_kdtree():
    """The kd-tree as Guo et al. describe it: cells split in the middle, dimensions in turn, density by the mean."""
    for name in BOTH:
        label = f"published-kdtree/{name}"
        results = compare(label, shared_scene(name), ["none", *WARPS_4D[:2]], **PAPER, **reference(name),
                          kdtree_split="cyclic", kdtree_target="mean")  # fmt: skip
        write_table(folder_of(label), comparison_table(results))


def published_realnvp():
    """Real NVP trained as published: separate networks, no encoding, batch normalisation, maximum likelihood."""
    for name in BOTH:
        label = f"published-realnvp/{name}"
        results = compare(label, shared_scene(name), ["none", WARPS_4D[0], WARPS_4D[2]], **PAPER, **reference(name), loss="likelihood",
                          networks="separate", encoding_bins=0, masks="alternating", bn="batch", couplings=8, width=64, rate=1e-3, jitter=0)  # fmt: skip
        write_table(folder_of(label), comparison_table(results))


def training_time():
    """MSE gain over training time on the Country Kitchen, one run a point: Real NVP by steps, kd-tree by candidates."""
    scene, options = shared_scene("country-kitchen"), {"size": "320x180", "max_depth": 8}
    measure = {"spp": 64, **reference("country-kitchen")}
    base = compare("training-time/baselines", scene, ["none", WARPS_4D[0]], **options, **measure)
    none, uniform = (mean(column(of_method(base, method), "mse")) for method in ("none", WARPS_4D[0]))
    budgets = [("realnvp", f"{n} steps", {"max_steps": n}) for n in (50, 150, 400, 1000, 3000)]
    budgets += [("kdtree", f"epp-{k}", {"epp": k}) for k in (0.5, 2, 8, 16, 64)]
    lines = {"realnvp": [], "kdtree": []}
    table = ["| warp | budget | CPU seconds of training | gain in MSE |", "|---|---|---|---|", "| none | | | 1 |", f"| uniform | | | {none / uniform:.2f} |"]
    for family, budget, training in budgets:
        label = f"training-time/{family}-{budget.replace(' ', '-')}"
        warp, seconds, _ = train(label, scene, f"{family}:film+bounce1", **options, **training)
        gained = none / mean(column(compare(label, scene, [warp], **options, **measure), "mse"))
        lines[family].append((seconds, gained))
        table.append(f"| {family} | {budget} | {seconds:.1f} | {gained:.2f} |")
    folder = folder_of("training-time")
    write_table(folder, table)
    line_chart(folder / "gain.svg", "CPU seconds of training, candidates included", "gain in MSE over plain path tracing", lines, rule=1)


def twelve_dims(epps=(1, 4, 16, 64, 256)):
    """12D on the kitchen (film and five bounces) with growing training sets: gain, time, and the memory that epp-4096 takes.

    epp-4096 has 131 M examples from 1.05 G candidates, an hour and a half of CPU time for these alone. So its cost is told from what a
    candidate costs, and its memory is measured where paths are cheap: as many examples, chunk by chunk from as many candidates.
    """
    scene, options = shared_scene("country-kitchen"), {"size": "320x180", "max_depth": 8, "spp": 32, "runs": 1, **reference("country-kitchen")}
    base = compare("twelve-dims/baselines", scene, ["none", f"uniform:{TWELVE}"], **options)
    table = ["| training set | candidates | CPU s | training, CPU s | peak memory, MB | held-out loss | gain in MSE | over uniform |",
             "|" + "---|" * 8]  # fmt: skip
    line = []
    for epp in epps:
        label = f"twelve-dims/epp-{epp}"
        (run,) = compare(label, scene, [f"realnvp:{TWELVE}"], epp=epp, **options)
        over_none, over_uniform = (gain(of_method(base, m), [run], "mse")[0] for m in ("none", f"uniform:{TWELVE}"))
        line.append((epp, over_none))
        cost = run["candidate_cpu_seconds"] / run["candidates"]
        loss = min(point["held_out"] for point in run["training_curve"])
        table.append(f"| epp-{epp} | {run['candidates'] / 1e6:.2f} M | {run['candidate_cpu_seconds']:.0f} | {run['train_cpu_seconds']:.0f} |"
                     f" {peak_memory(label, 'compare') / 1e6:.0f} | {loss:.3f} | {over_none:.2f} | {over_uniform:.2f} |")  # fmt: skip
    _, _, memory = train("twelve-dims/memory", own_scene("box"), f"realnvp:{TWELVE}", size="64x48", max_depth=2,
                         examples=4096 * 200 * 160, alpha=1, max_steps=100)  # fmt: skip
    count = 8 * 4096 * 200 * 160
    table.append(f"| epp-4096, not trained | {count / 1e6:.0f} M | {count * cost:.0f} | | {memory / 1e6:.0f} | | | |")
    folder = folder_of("twelve-dims")
    write_table(folder, table)
    line_chart(folder / "gain.svg", "training set, epp", "gain in MSE over plain path tracing", {"realnvp, 12D": line}, rule=1)


ALL = (kitchen, white_room, white_room_epp, error_curves, published_kdtree, published_realnvp, training_time, twelve_dims)
