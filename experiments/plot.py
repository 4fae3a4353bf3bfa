"""Line charts as SVG, with nothing but the standard library."""

import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 640, 360, 64, 16, 16, 48
COLOURS = ("#1f6fb4", "#d1572b", "#3a8f4d", "#7a4fa3", "#8a6d1f", "#4a4a4a", "#c2447f", "#2a9d9d")


def log_ticks(low, high):
    """1, 2 and 5 times powers of ten within [low, high]; powers of ten alone, or a few of them, where those are many."""
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    decades = math.log10(high / low)
    digits = (1, 2, 5) if decades < 3.5 else (1,)
    step = max(1, math.ceil(decades / 8))
    return [m * 10.0**e for e in exponents for m in digits if e % step == 0 and low <= m * 10.0**e <= high]


def linear_ticks(low, high):
    """About five round numbers within [low, high]."""
    step = 10.0 ** math.floor(math.log10((high - low) / 5))
    step *= next(m for m in (1, 2, 5, 10) if (high - low) / (m * step) <= 6)
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def range_of(values, log):
    """What an axis covers, with a margin."""
    low, high = min(values), max(values)
    if log:
        margin = max(1.1, (high / low) ** 0.06)
        return low / margin, high * margin
    margin = 0.08 * (high - low) or 1.0
    return low - margin, high + margin


def usable(point, log_x, log_y):
    return (not log_x or point[0] > 0) and (not log_y or point[1] > 0) and math.isfinite(point[1])


def line_chart(path, x_label, y_label, lines, log_x=True, log_y=False, rule=None):
    """Writes a chart of `lines`, {name: [(x, y) or (x, y, error), ...]}; `rule` is a y with a dashed line.

    Points that a logarithmic axis cannot show are left out; an error bar that would reach below its end stops there.
    """
    lines = {name: [p for p in points if usable(p, log_x, log_y)] for name, points in lines.items()}
    points = [p for line in lines.values() for p in line]
    ends = [p[1] + s * (p[2] if len(p) > 2 else 0.0) for p in points for s in (-1, 1)] + ([] if rule is None else [rule])
    floor = 0.5 * min(p[1] for p in points) if log_y else -math.inf
    x_low, x_high = range_of([p[0] for p in points], log_x)
    y_low, y_high = range_of([max(y, floor) for y in ends], log_y)

    def place(value, low, high, log):
        return math.log(value / low) / math.log(high / low) if log else (value - low) / (high - low)

    def across(x):
        return LEFT + (WIDTH - LEFT - RIGHT) * place(x, x_low, x_high, log_x)

    def down(y):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * place(max(y, y_low), y_low, y_high, log_y)

    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12" fill="#444">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']  # fmt: skip
    for x in (log_ticks if log_x else linear_ticks)(x_low, x_high):
        svg.append(f'<path d="M{across(x):.1f} {TOP}V{bottom}" stroke="#e4e4e4"/>')
        svg.append(f'<text x="{across(x):.1f}" y="{bottom + 16}" text-anchor="middle">{x:g}</text>')
    for y in (log_ticks if log_y else linear_ticks)(y_low, y_high):
        svg.append(f'<path d="M{LEFT} {down(y):.1f}H{right}" stroke="#e4e4e4"/>')
        svg.append(f'<text x="{LEFT - 6}" y="{down(y) + 4:.1f}" text-anchor="end">{y:g}</text>')
    if rule is not None:
        svg.append(f'<path d="M{LEFT} {down(rule):.1f}H{right}" stroke="#888" stroke-dasharray="4 4"/>')
    svg.append(f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 10}" text-anchor="middle">{x_label}</text>')
    svg.append(f'<text transform="translate(14 {(TOP + bottom) / 2}) rotate(-90)" text-anchor="middle">{y_label}</text>')
    for k, (name, line) in enumerate(lines.items()):
        colour = COLOURS[k % len(COLOURS)]
        places = " ".join(f"{across(p[0]):.1f},{down(p[1]):.1f}" for p in line)
        svg.append(f'<polyline points="{places}" fill="none" stroke="{colour}" stroke-width="2"/>')
        for p in line:
            if len(p) > 2 and p[2] > 0:
                x, top, low = across(p[0]), down(p[1] + p[2]), down(p[1] - p[2])
                svg.append(f'<path d="M{x:.1f} {top:.1f}V{low:.1f}M{x - 4:.1f} {top:.1f}h8M{x - 4:.1f} {low:.1f}h8" stroke="{colour}"/>')
            svg.append(f'<circle cx="{across(p[0]):.1f}" cy="{down(p[1]):.1f}" r="3" fill="{colour}"/>')
    svg += legend(lines, bottom, right)
    path.write_text("\n".join([*svg, "</svg>"]) + "\n", encoding="utf-8")
    print(f"chart: {path}", file=sys.stderr)


def legend(lines, bottom, right):
    """Names in the colours of their lines, in the lower corner that the lines leave free: left where most fall, right where they rise."""
    falling = sum(1 if line[-1][1] < line[0][1] else -1 for line in lines.values() if line) > 0
    x, anchor = (LEFT + 10, "start") if falling else (right - 8, "end")
    return [f'<text x="{x}" y="{bottom - 12 - 17 * (len(lines) - 1 - k)}" text-anchor="{anchor}" fill="{COLOURS[k % len(COLOURS)]}">{name}</text>'
            for k, name in enumerate(lines)]  # fmt: skip
