"""What was trained in one view, used in others."""

import math

from plot import line_chart
from records import write_record
from tables import gain, mean, of_method, standard_error
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
    tables = retrain("reuse", scene, weights, ANGLES, (10, 30, 100), "ln E[g / q]", 0.02, epp=1)
    field, _, _ = train("reuse/field", scene, "field", **FILM, epp=8)
    fields = []
    for angle in ANGLES:
        turned, measure, base = baselines("reuse", scene, angle)
        fielded = compare(f"reuse/{angle}/field", scene, ["field", field], **turned, **measure)
        fields.append(by_training(angle, base, of_method(fielded, "field"), of_method(fielded, str(field))))
    write_record("reuse", {**tables, "field": fields}, FILM)


def reuse_published():
    """The same with networks, loss and rate as published, turned by 45 and 90 degrees."""
    scene = turned_scene("white-room")
    weights, _, _ = train("reuse-published", scene, WARP, **FILM, epp=4, max_steps=600, rate=1e-3, **PUBLISHED)
    tables = retrain("reuse-published", scene, weights, ANGLES[1:], (100, 200, 400, 800), "-ln q", 0.005, epp=4, rate=1e-4, **PUBLISHED)
    write_record("reuse-published", tables, {**FILM, "epp": 4, "rate": 1e-4, **PUBLISHED})


def baselines(label, scene, angle):
    """Options of a view, options to measure in it, and the runs of `none` and `uniform` there."""
    turned = {**FILM, "defines": {"turn": angle}}
    measure = {"spp": 32, "runs": 2, **render_reference(f"{label}/{angle}", scene, 256, objective="mse", **turned)}
    return turned, measure, compare(f"{label}/{angle}/baselines", scene, ["none", UNIFORM], **turned, **measure)


def retrain(label, scene, weights, angles, all_steps, loss_name, tolerance, **training):
    """Rows and charts of training from scratch and from `weights`, for so many steps; rows of how much sooner the second comes within
    `tolerance` of the first one's best loss."""
    rows, times = [], []
    for angle in angles:
        turned, measure, base = baselines(label, scene, angle)
        uniform = of_method(base, UNIFORM)
        losses, gains = {}, {}
        for start, init in (("from scratch", {}), ("reused weights", {"init": weights})):
            for steps in all_steps:
                place = f"{label}/{angle}/{start.replace(' ', '-')}-{steps}"
                runs = compare(place, scene, [WARP], **turned, **measure, max_steps=steps, **training, **init)
                held_out = [run["training_curve"][-1]["held_out"] for run in runs]
                loss, gained = [mean(held_out), standard_error(held_out)], gain(uniform, runs, "mse")
                losses.setdefault(start, []).append((steps, *loss))
                gains.setdefault(start, []).append((steps, *gained))
                seconds = mean([run["train_cpu_seconds"] for run in runs])
                rows.append({"turned": f"{angle}°", "training": start, "steps": steps, "train_cpu_seconds": seconds,
                             "held_out": loss, "mse_over_uniform": gained})  # fmt: skip
        folder = folder_of(f"{label}/{angle}")
        line_chart(folder / "loss.svg", "training steps", f"held-out loss, {loss_name}", losses)
        line_chart(folder / "gain.svg", "training steps", "gain in MSE over uniform", gains, rule=1)
        times.append({"turned": f"{angle}°", **sooner(losses["from scratch"], losses["reused weights"], tolerance)})
    return {"white-room": rows, "sooner": times}


def by_training(angle, base, scratch, trained_before):
    """A row: gains over plain path tracing of a field that learns anew in this view, and of one that learned in another."""
    none, cells = of_method(base, "none"), {"turned": f"{angle}°"}
    for key, name in (("relmse", "relMSE"), ("mse", "MSE")):
        cells[f"{name} gain, from scratch"] = gain(none, scratch, key)
        cells[f"{name} gain, trained before"] = gain(none, trained_before, key)
    return cells


def sooner(scratch, reused, tolerance):
    """The best loss from scratch, where each line first comes within `tolerance` of it, and the ratio of both."""
    goal = min(loss for _, loss, _ in scratch) + tolerance
    first, second = steps_to(scratch, goal), steps_to(reused, goal)
    at_once = second <= reused[0][0]
    return {
        "best loss from scratch": goal - tolerance,
        "steps to come near it, from scratch": round(first),
        "from reused weights": "not reached" if math.isinf(second) else f"{'at most ' if at_once else ''}{second:.0f}",
        "sooner": "–" if math.isinf(second) else f"{'at least ' if at_once else ''}{first / second:.1f} ×",
    }


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
