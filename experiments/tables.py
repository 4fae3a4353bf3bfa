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


def comparison_table(results, extra=None, baseline="none"):
    """Markdown rows for each method: errors, gains over the baseline and over `uniform` of the same numbers, seconds."""
    lines = ["| method | runs | MSE | gain | over uniform | relMSE | gain | candidates s | training s | warping s | tracing s |", "|" + "---|" * 11]
    base = of_method(results, baseline)
    for method in methods_of(results):
        runs = of_method(results, method)
        uniform = of_method(results, "uniform:" + method.partition(":")[2])
        cells = [f"`{method}`" + (f" {extra}" if extra else ""), str(len(runs))]
        for key in ("mse", "relmse"):
            values = column(runs, key)
            cells.append(f"{mean(values):.4g} ± {standard_error(values):.2g}")
            cells.append("{:.2f} ± {:.2f}".format(*gain(base, runs, key)))
            if key == "mse":
                cells.append("{:.2f} ± {:.2f}".format(*gain(uniform, runs, key)) if uniform else "")
        cells += [f"{mean(column(runs, f'{part}_seconds')):.1f}" for part in ("candidate", "train", "warp", "trace")]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def write_table(folder, lines, name="table.md"):
    """Into the experiment's folder, and to the terminal."""
    text = "\n".join(lines) + "\n"
    (folder / name).write_text(text, encoding="utf-8")
    print(text)
    print(f"table: {folder / name}", file=sys.stderr)
