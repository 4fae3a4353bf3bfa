"""Means over runs with their standard errors, and rows of them: what an experiment leaves for the documentation.

A row is a dict. What was measured is a pair, [mean, standard error]; the rest are names and single values. markdown.py shows rows.
"""

import math


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


def measured(runs, key):
    """[mean, standard error] of a number of each run."""
    return [mean(column(runs, key)), standard_error(column(runs, key))]


def methods_of(results):
    return list(dict.fromkeys(run["method"] for run in results))


def gain(baseline, runs, key):
    """Mean error of the baseline over that of the runs, and its standard error."""
    a, b = column(baseline, key), column(runs, key)
    ratio = mean(a) / mean(b)
    return [ratio, abs(ratio) * math.hypot(standard_error(a) / mean(a), standard_error(b) / mean(b))]


def gain_by_cost(baseline, runs, key):
    """The same at equal time, computed: error times CPU seconds, training included. The baseline's error falls as one over its time, so
    this is its error after as many seconds as the method took, over the method's; other work on the machine does not count."""
    of_time = [[{"cost": run[key] * run["total_cpu_seconds"]} for run in some] for some in (baseline, runs)]
    return gain(*of_time, "cost")


def pays_after(baseline, runs):
    """CPU seconds after which a method's MSE is below the baseline's, whatever was spent on training counted; None if it never is."""
    plain = mean(column(baseline, "mse")) * mean(column(baseline, "total_cpu_seconds"))
    rendering = mean([run["warp_cpu_seconds"] + run["trace_cpu_seconds"] for run in runs])
    training = mean([run["candidate_cpu_seconds"] + run["train_cpu_seconds"] for run in runs])
    warped = mean(column(runs, "mse")) * rendering
    return training * plain / (plain - warped) if warped < plain else None


PHASES = ("candidate", "train", "warp", "trace", "total")


def rows_of(results, baselines=None, label=None, baseline="none"):
    """A row for each method: errors, gains over the baseline and over `uniform` of the same numbers, at equal samples and by cost, CPU
    seconds of each phase. `baselines` are runs that were measured apart; `label` says what is special about these results."""
    rows, baselines = [], baselines or results
    base = of_method(baselines, baseline)
    for method in methods_of(results):
        runs = of_method(results, method)
        uniform = of_method(baselines, "uniform:" + method.partition(":")[2])
        row = {"method": method, **({"label": label} if label else {}), "runs": len(runs), "spp": measured(runs, "spp")}
        for key in ("mse", "relmse"):
            row[key] = measured(runs, key)
            row[f"{key}_gain"] = gain(base, runs, key) if method != baseline else 1.0
            row[f"{key}_gain_by_cost"] = gain_by_cost(base, runs, key) if method != baseline else 1.0
        if uniform:
            row["mse_over_uniform"] = gain(uniform, runs, "mse") if not method.startswith("uniform:") else 1.0
        if method != baseline:
            row["pays_after"] = pays_after(base, runs)
        row |= {f"{phase}_cpu_seconds": measured(runs, f"{phase}_cpu_seconds") for phase in PHASES}
        row["total_seconds"] = measured(runs, "total_seconds")
        rows.append(row)
    return rows
