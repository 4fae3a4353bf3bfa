"""What was trained in one view, used in others."""

import math

from plot import line_chart
from tables import comparison_table, gain, mean, of_method, standard_error, write_table
from tool import compare, folder_of, render_reference, train, turned_scene

ANGLES = (10, 45, 90)
WARP = "realnvp:film+bounce1"
UNIFORM = "uniform:film+bounce1"
FILM = {"size": "128x72", "max_depth": 8}
# Networks, loss and rate as published, where training from scratch takes thousands of steps; smaller, and with actnorm.
PUBLISHED = {"loss": "likelihood", "networks": "separate", "encoding_bins": 0, "masks": "alternating", "couplings": 8, "width": 64, "jitter": 0}


def reuse():
    """Weights trained in one view, reused for a camera turned by 10, 45 and 90 degrees: loss and gain over training, and how much sooner.

    On the White Room. A joint warp has to be trained again, from the old weights or from scratch. A field lives in the room, not in the
    image, and serves every view as it is.
    """
    scene = turned_scene("white-room")
    weights, _, _ = train("reuse", scene, WARP, **FILM, epp=8, max_steps=500)
    retrain("reuse", scene, weights, ANGLES, (10, 30, 100), "ln E[g / q]", 0.02, epp=1)
    field, _, _ = train("reuse/field", scene, "field", **FILM, epp=8)
    fields = []
    for angle in ANGLES:
        turned, measure, base = baselines("reuse", scene, angle)
        fielded = compare(f"reuse/{angle}/field", scene, ["field", field], **turned, **measure)
        fields += comparison_table(base + [{**run, "method": "field, trained before" if run["method"] == str(field) else "field"} for run in fielded])
    write_table(folder_of("reuse"), fields, "field.md")


def reuse_published():
    """The same with networks, loss and rate as published, turned by 45 and 90 degrees."""
    scene = turned_scene("white-room")
    weights, _, _ = train("reuse-published", scene, WARP, **FILM, epp=4, max_steps=600, rate=1e-3, **PUBLISHED)
    retrain("reuse-published", scene, weights, ANGLES[1:], (100, 200, 400, 800), "-ln q", 0.005, epp=4, rate=1e-4, **PUBLISHED)


def baselines(label, scene, angle):
    """Options of a view, options to measure in it, and the runs of `none` and `uniform` there."""
    turned = {**FILM, "defines": {"turn": angle}}
    measure = {"spp": 32, "runs": 2, **render_reference(f"{label}/{angle}", scene, 256, objective="mse", **turned)}
    return turned, measure, compare(f"{label}/{angle}/baselines", scene, ["none", UNIFORM], **turned, **measure)


def retrain(label, scene, weights, angles, all_steps, loss_name, tolerance, **training):
    """Tables and charts of training from scratch and from `weights`, for so many steps; and of how much sooner the second comes within
    `tolerance` of the first one's best loss."""
    table = ["| turned by | training | steps | CPU seconds | held-out loss | MSE | gain over uniform |", "|" + "---|" * 7]
    times = ["| turned by | best loss from scratch | steps to come near it, from scratch | from reused weights | sooner |", "|" + "---|" * 5]
    for angle in angles:
        turned, measure, base = baselines(label, scene, angle)
        uniform = of_method(base, UNIFORM)
        table += [row(angle, f"`{name}`", "", "", of_method(base, name), uniform) for name in ("none", UNIFORM)]
        losses, gains = {}, {}
        for start, init in (("from scratch", {}), ("reused weights", {"init": weights})):
            for steps in all_steps:
                place = f"{label}/{angle}/{start.replace(' ', '-')}-{steps}"
                runs = compare(place, scene, [WARP], **turned, **measure, max_steps=steps, **training, **init)
                loss = [run["training_curve"][-1]["held_out"] for run in runs]
                losses.setdefault(start, []).append((steps, mean(loss), standard_error(loss)))
                gains.setdefault(start, []).append((steps, *gain(uniform, runs, "mse")))
                seconds = mean([run["train_cpu_seconds"] for run in runs])
                table.append(row(angle, start, steps, f"{seconds:.2f}", runs, uniform, f"{mean(loss):.3f}"))
        folder = folder_of(f"{label}/{angle}")
        line_chart(folder / "loss.svg", "training steps", f"held-out loss, {loss_name}", losses)
        line_chart(folder / "gain.svg", "training steps", "gain in MSE over uniform", gains, rule=1)
        times.append(f"| {angle}° | " + " | ".join(sooner(losses["from scratch"], losses["reused weights"], tolerance)) + " |")
    write_table(folder_of(label), table)
    write_table(folder_of(label), times, "sooner.md")


def row(angle, what, steps, seconds, runs, uniform, loss=""):
    mse = [run["mse"] for run in runs]
    gained, error = gain(uniform, runs, "mse")
    return f"| {angle}° | {what} | {steps} | {seconds} | {loss} | {mean(mse):.4g} ± {standard_error(mse):.2g} | {gained:.2f} ± {error:.2f} |"


def sooner(scratch, reused, tolerance):
    """Cells: the best loss from scratch, where each line first comes within `tolerance` of it, and the ratio of both."""
    goal = min(loss for _, loss, _ in scratch) + tolerance
    first, second = steps_to(scratch, goal), steps_to(reused, goal)
    cells = [f"{goal - tolerance:.3f}", f"{first:.0f}"]
    if math.isinf(second):
        return [*cells, "not reached", ""]
    at_once = second <= reused[0][0]
    return [*cells, f"{'at most ' if at_once else ''}{second:.0f}", f"{'at least ' if at_once else ''}{first / second:.1f} ×"]


def steps_to(line, goal):
    """Steps after which a loss is reached for the first time, between two points by the logarithm; infinite if it never is."""
    before = None
    for steps, loss, _ in line:
        if loss <= goal:
            if before is None:
                return steps
            share = (goal - before[1]) / (loss - before[1])
            return before[0] * (steps / before[0]) ** share
        before = (steps, loss)
    return math.inf


ALL = (reuse, reuse_published)
