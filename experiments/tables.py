"""Means over runs, with their standard errors, and tables of them."""

import math
import sys


def mean(values):
    return sum(values) / len(values)


def standard_error(values):
    """Of the mean; 0 for a single value."""
    if len(values) < 2:
        return 0.0
    m = mean(values)
    return math.sqrt(sum((v - m) ** 2 for v in values) / (len(values) - 1) / len(values))


def of_method(results, method):
    return [run for run in results if run["method"] == method]


def column(runs, key):
    return [run[key] for run in runs]


def methods_of(results):
    return list(dict.fromkeys(run["method"] for run in results))


def gain(baseline, runs, key):
    """Mean error of the baseline over that of the runs, and its standard error."""
    a, b = column(baseline, key), column(runs, key)
    ratio = mean(a) / mean(b)
    return ratio, abs(ratio) * math.hypot(standard_error(a) / mean(a), standard_error(b) / mean(b))


def equal_time_gain(baseline, runs, key):
    """The same at equal time: error times CPU seconds, training included. The baseline's error falls as one over its time, so this is
    its error after as many seconds as the method took, over the method's; and other work on the machine does not count."""
    of_time = [[{"cost": run[key] * run["total_cpu_seconds"]} for run in some] for some in (baseline, runs)]
    return gain(*of_time, "cost")


def pays_after(baseline, runs):
    """CPU seconds after which a method's MSE is below the baseline's, whatever was spent on training counted; infinite if it never is."""
    plain = mean(column(baseline, "mse")) * mean(column(baseline, "total_cpu_seconds"))
    rendering = mean([run["warp_cpu_seconds"] + run["trace_cpu_seconds"] for run in runs])
    training = mean([run["candidate_cpu_seconds"] + run["train_cpu_seconds"] for run in runs])
    warped = mean(column(runs, "mse")) * rendering
    return training * plain / (plain - warped) if warped < plain else math.inf


PHASES = ("candidate", "train", "warp", "trace")


def comparison_table(results, baseline="none"):
    """Markdown: for each method errors, gains over the baseline and over `uniform` of the same numbers, the gain in MSE at equal time,
    CPU seconds after which it pays, and those of each phase."""
    lines = ["| method | runs | MSE | gain | over uniform | relMSE | gain | gain at equal time | pays after, s | candidates | training | warping | tracing |",
             "|" + "---|" * 13]  # fmt: skip
    return lines + rows_of(results, results, baseline=baseline)


def rows_of(results, baselines, extra=None, baseline="none"):
    """Rows of that table, for results that were measured apart from the baselines; `extra` stands beside the method."""
    lines, base = [], of_method(baselines, baseline)
    for method in methods_of(results):
        runs = of_method(results, method)
        uniform = of_method(baselines, "uniform:" + method.partition(":")[2])
        cells = [f"`{method}`" + (f" {extra}" if extra else ""), str(len(runs))]
        for key in ("mse", "relmse"):
            values = column(runs, key)
            cells.append(f"{mean(values):.4g} ± {standard_error(values):.2g}")
            cells.append("{:.2f} ± {:.2f}".format(*gain(base, runs, key)))
            if key == "mse":
                cells.append("{:.2f} ± {:.2f}".format(*gain(uniform, runs, key)) if uniform else "")
        cells += [f"{equal_time_gain(base, runs, 'mse')[0]:.2f}", "" if method == baseline else f"{pays_after(base, runs):.0f}".replace("inf", "never")]
        cells += [f"{mean(column(runs, f'{phase}_cpu_seconds')):.1f}" for phase in PHASES]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def write_table(folder, lines, name="table.md"):
    """Into the experiment's folder, and to the terminal."""
    text = "\n".join(lines) + "\n"
    (folder / name).write_text(text, encoding="utf-8")
    print(text)
    print(f"table: {folder / name}", file=sys.stderr)
