"""Line charts as SVG, with nothing but the standard library."""
import math

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 640, 360, 56, 16, 16, 48
COLOURS = ("#1f6fb4", "#d1572b", "#3a8f4d", "#7a4fa3")


def log_ticks(low, high):
    """1, 2 and 5 times powers of ten within [low, high]."""
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [m * 10.0**e for e in exponents for m in (1, 2, 5) if low <= m * 10.0**e <= high]


def linear_ticks(low, high):
    """About five round numbers within [low, high]."""
    step = 10.0 ** math.floor(math.log10((high - low) / 5))
    step *= next(m for m in (1, 2, 5, 10) if (high - low) / (m * step) <= 6)
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def line_chart(path, x_label, y_label, lines):
    """Writes a chart of `lines`, {name: [(x, y), ...]}, with a logarithmic x axis and a dashed line at y = 1."""
    xs = [x for points in lines.values() for x, _ in points]
    ys = [y for points in lines.values() for _, y in points] + [1.0]
    x_low, x_high = min(xs) / 1.2, max(xs) * 1.2
    margin = 0.08 * (max(ys) - min(ys))
    y_low, y_high = min(ys) - margin, max(ys) + margin

    def across(x):
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log(x / x_low) / math.log(x_high / x_low)

    def down(y):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (y - y_low) / (y_high - y_low)

    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12" fill="#444">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']  # fmt: skip
    for x in log_ticks(x_low, x_high):
        svg.append(f'<path d="M{across(x):.1f} {TOP}V{bottom}" stroke="#e4e4e4"/>')
        svg.append(f'<text x="{across(x):.1f}" y="{bottom + 16}" text-anchor="middle">{x:g}</text>')
    for y in linear_ticks(y_low, y_high):
        svg.append(f'<path d="M{LEFT} {down(y):.1f}H{right}" stroke="#e4e4e4"/>')
        svg.append(f'<text x="{LEFT - 6}" y="{down(y) + 4:.1f}" text-anchor="end">{y:g}</text>')
    svg.append(f'<path d="M{LEFT} {down(1):.1f}H{right}" stroke="#888" stroke-dasharray="4 4"/>')
    svg.append(f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 10}" text-anchor="middle">{x_label}</text>')
    svg.append(f'<text transform="translate(14 {(TOP + bottom) / 2}) rotate(-90)" text-anchor="middle">{y_label}</text>')
    for k, (name, points) in enumerate(lines.items()):
        colour = COLOURS[k % len(COLOURS)]
        places = [(across(x), down(y)) for x, y in points]
        svg.append(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in places)}" fill="none" stroke="{colour}" stroke-width="2"/>')
        svg += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"/>' for x, y in places]
        svg.append(f'<text x="{right - 8}" y="{bottom - 12 - 18 * (len(lines) - 1 - k)}" text-anchor="end" fill="{colour}">{name}</text>')
    path.write_text("\n".join([*svg, "</svg>"]) + "\n", encoding="utf-8")
