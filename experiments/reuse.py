"""What was trained in one view, used in others."""

import math

from plot import line_chart
from tables import comparison_table, gain, mean, of_method, standard_error, write_table
from tool import compare, folder_of, render_reference, train, turned_scene

ANGLES = (10, 45, 90)
STEPS = (10, 30, 100)
WARP = "realnvp:film+bounce1"


def reuse():
    """Weights trained in one view, reused for a camera turned by 10, 45 and 90 degrees: loss and gain over training, and how much sooner.

    On the White Room. A joint warp has to be trained again, from the old weights or from scratch. A field lives in the room, not in the
    image, and serves every view as it is.
    """
    scene, film = turned_scene("white-room"), {"size": "128x72", "max_depth": 8}
    weights, _, _ = train("reuse", scene, WARP, **film, epp=8, max_steps=500)
    field, _, _ = train("reuse/field", scene, "field", **film, epp=8)
    table = ["| turned by | training | steps | CPU seconds | held-out loss | gain in MSE over uniform |", "|---|---|---|---|---|---|"]
    times = ["| turned by | best loss from scratch | steps to reach it from scratch | from reused weights | sooner |", "|---|---|---|---|---|"]
    fields = []
    for angle in ANGLES:
        turned = {**film, "defines": {"turn": angle}}
        measure = {"spp": 32, "runs": 2, **render_reference(f"reuse/{angle}", scene, 256, objective="mse", **turned)}
        base = compare(f"reuse/{angle}/baselines", scene, ["none", "uniform:film+bounce1"], **turned, **measure)
        fielded = compare(f"reuse/{angle}/field", scene, ["field", field], **turned, **measure)
        fields += comparison_table(base + [{**run, "method": "field, trained before" if run["method"] == str(field) else "field"} for run in fielded])
        for name in ("none", "uniform:film+bounce1"):
            gained = gain(of_method(base, "uniform:film+bounce1"), of_method(base, name), "mse")
            table.append(f"| {angle}° | `{name}` | | | | {gained[0]:.2f} ± {gained[1]:.2f} |")
        losses, gains = {}, {}
        for start, init in (("from scratch", {}), ("reused weights", {"init": weights})):
            for steps in STEPS:
                label = f"reuse/{angle}/{start.replace(' ', '-')}-{steps}"
                runs = compare(label, scene, [WARP], **turned, **measure, epp=1, max_steps=steps, **init)
                loss = [run["training_curve"][-1]["held_out"] for run in runs]
                seconds = mean([run["train_cpu_seconds"] for run in runs])
                gained = gain(of_method(base, "uniform:film+bounce1"), runs, "mse")
                losses.setdefault(start, []).append((steps, mean(loss), standard_error(loss)))
                gains.setdefault(start, []).append((steps, *gained))
                table.append(f"| {angle}° | {start} | {steps} | {seconds:.2f} | {mean(loss):.3f} | {gained[0]:.2f} ± {gained[1]:.2f} |")
        folder = folder_of(f"reuse/{angle}")
        line_chart(folder / "loss.svg", "training steps", "held-out loss, ln E[g / q]", losses)
        line_chart(folder / "gain.svg", "training steps", "gain in MSE over uniform", gains, rule=1)
        times.append(f"| {angle}° | " + " | ".join(sooner(losses["from scratch"], losses["reused weights"])) + " |")
    write_table(folder_of("reuse"), table)
    write_table(folder_of("reuse"), times, "sooner.md")
    write_table(folder_of("reuse"), fields, "field.md")


def sooner(scratch, reused):
    """Cells: the best loss from scratch, where each line first comes within 0.02 of it (2 % of the variance), and the ratio of both."""
    goal = min(loss for _, loss, _ in scratch) + 0.02
    first, second = steps_to(scratch, goal), steps_to(reused, goal)
    cells = [f"{goal - 0.02:.3f}", f"{first:.0f}"]
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


ALL = (reuse,)
