"""Error over samples and over time, from what `compare` measured after each pass."""

from plot import line_chart
from tables import mean, methods_of, of_method, standard_error


def error_lines(results, key, over):
    """{method: [(samples per pixel or CPU seconds, mean error over runs, its standard error), ...]}, a point for each pass."""
    lines = {}
    for method in methods_of(results):
        passes = zip(*(run["error_curve"] for run in of_method(results, method)))
        lines[method] = [(mean([p[over] for p in points]), mean([p[key] for p in points]), standard_error([p[key] for p in points]))
                         for points in passes]  # fmt: skip
    return lines


def error_charts(folder, results):
    """Four charts into `folder`: MSE and relMSE over samples per pixel and over CPU seconds, training included."""
    for key, name in (("mse", "MSE"), ("relmse", "relMSE")):
        line_chart(folder / f"{key}-over-spp.svg", "samples per pixel", name, error_lines(results, key, "spp"), log_y=True)
        line_chart(folder / f"{key}-over-time.svg", "CPU seconds, training included", name, error_lines(results, key, "cpu_seconds"), log_y=True)
