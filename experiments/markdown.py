"""Rows as Markdown tables: headings of columns by their keys, values with as many digits as their standard errors allow, four at most."""

import math

HEADINGS = {
    "runs": "runs",
    "spp": "spp",
    "none_spp": "spp of `none`",
    "mse": "MSE",
    "relmse": "relMSE",
    "mse_gain": "MSE gain",
    "relmse_gain": "relMSE gain",
    "mse_gain_by_cost": "MSE gain at equal CPU time",
    "relmse_gain_by_cost": "relMSE gain at equal CPU time",
    "mse_over_uniform": "MSE gain over `uniform`",
    "mse_over_path": "MSE gain over `path`",
    "published": "published",
    "pays_after": "pays after, CPU s",
    "candidate_cpu_seconds": "candidates, CPU s",
    "resample_cpu_seconds": "resampling, CPU s",
    "train_cpu_seconds": "training, CPU s",
    "warp_cpu_seconds": "warping, CPU s",
    "trace_cpu_seconds": "tracing, CPU s",
    "total_cpu_seconds": "CPU s",
    "total_seconds": "seconds",
    "held_out": "held-out loss",
    "turned": "turned by",
    "peak_memory": "peak memory, MB",
}
TITLES = {"country-kitchen": "Country Kitchen", "white-room": "White Room"}


def decimals_for(error):
    """Digits behind the point that a standard error is worth: two significant ones where the first is 1, else one."""
    leading = math.floor(math.log10(error))
    return max(0, -leading + (1 if error < 2 * 10.0**leading else 0))


def number(value):
    """Without a known error: three significant digits, and all that stand before the point."""
    if isinstance(value, int):
        return f"{value:,}" if abs(value) >= 10000 else str(value)
    if value == 0:
        return "0"
    return f"{value:,.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"


def pair(value, error):
    if not error > 0:
        return number(value)
    digits = decimals_for(error)
    if value:
        digits = min(digits, max(0, 3 - math.floor(math.log10(abs(value)))))
    return f"{value:,.{digits}f} ± {error:.{digits}f}"


def short(value, error=0.0):
    """For running text: without the error, and with two digits behind the point at most."""
    digits = decimals_for(error) if error > 0 else max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:,.{min(digits, 2 if abs(value) >= 0.1 else digits)}f}"


def is_ratio(key):
    return "gain" in key or "over" in key or key == "published"


def cell(row, key):
    value = row.get(key)
    if key == "method":
        return f"`{value}`" + (f" {row['label']}" if "label" in row else "")
    if value is None:
        return "never" if key == "pays_after" and key in row else "–"
    if isinstance(value, (list, tuple)):
        if value[1] > 0:
            return pair(*value)
        value = value[0]
    if isinstance(value, float) and is_ratio(key) and value < 1:
        return f"{value:.2f}"
    return value if isinstance(value, str) else number(value)


def title(table):
    """Of a table that is named after its scene, `60-s-country-kitchen`."""
    return next((words for scene, words in TITLES.items() if table.endswith(scene)), table)


def heading(key):
    return HEADINGS.get(key, key.replace("_", " "))


def table(rows, columns):
    """Lines of Markdown; columns are pairs of key and heading."""
    lines = ["| " + " | ".join(name for _, name in columns) + " |", "|" + "---|" * len(columns)]
    return lines + ["| " + " | ".join(cell(row, key) for key, _ in columns) + " |" for row in rows]


def whole_table(rows):
    """All that the rows hold."""
    keys = list(dict.fromkeys(key for row in rows for key in row if key != "label"))
    return table(rows, [(key, heading(key)) for key in keys])
