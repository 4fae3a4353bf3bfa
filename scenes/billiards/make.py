#!/usr/bin/env python3
"""Writes the meshes and textures of scene.xml (pure Python, some seconds): `python3 make.py`."""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tools"))

from images import mix, noise, write_png  # noqa: E402
from meshes import Mesh, revolve, rounded_box, tube, write_ply  # noqa: E402

COLOURS = {1: (0.93, 0.72, 0.08), 2: (0.10, 0.22, 0.62), 3: (0.78, 0.12, 0.09), 4: (0.34, 0.14, 0.48), 5: (0.92, 0.42, 0.08),
           6: (0.07, 0.40, 0.20), 7: (0.48, 0.08, 0.09), 8: (0.055, 0.055, 0.06)}  # fmt: skip
IVORY = (0.93, 0.90, 0.82)

# Strokes of the digits in a box of 1 x 2, as chains of points.
DIGITS = {
    0: [[(0.5, 2), (0.05, 1.5), (0.05, 0.5), (0.5, 0), (0.95, 0.5), (0.95, 1.5), (0.5, 2)]],
    1: [[(0.2, 1.6), (0.55, 2), (0.55, 0)]],
    2: [[(0.05, 1.55), (0.3, 2), (0.75, 2), (0.95, 1.5), (0.05, 0), (0.95, 0)]],
    3: [[(0.05, 1.8), (0.5, 2), (0.9, 1.6), (0.45, 1.08), (0.95, 0.5), (0.5, 0), (0.05, 0.25)]],
    4: [[(0.75, 0), (0.75, 2), (0.05, 0.6), (1, 0.6)]],
    5: [[(0.9, 2), (0.15, 2), (0.1, 1.15), (0.6, 1.25), (0.95, 0.65), (0.5, 0), (0.05, 0.2)]],
    6: [[(0.8, 2), (0.2, 1.1), (0.05, 0.5), (0.5, 0), (0.95, 0.5), (0.55, 1.05), (0.1, 0.7)]],
    7: [[(0.05, 2), (0.95, 2), (0.35, 0)]],
    8: [[(0.5, 1.08), (0.1, 1.5), (0.5, 2), (0.9, 1.5), (0.5, 1.08), (0.05, 0.5), (0.5, 0), (0.95, 0.5), (0.5, 1.08)]],
    9: [[(0.2, 0), (0.8, 0.9), (0.95, 1.5), (0.5, 2), (0.05, 1.5), (0.45, 0.95), (0.9, 1.3)]],
}


def distance_to_stroke(p, chain):
    best = 9.0
    for (ax, ay), (bx, by) in zip(chain, chain[1:]):
        dx, dy = bx - ax, by - ay
        t = max(0.0, min(1.0, ((p[0] - ax) * dx + (p[1] - ay) * dy) / (dx * dx + dy * dy)))
        best = min(best, math.hypot(p[0] - ax - t * dx, p[1] - ay - t * dy))
    return best


def ball_paint(number, width=192, height=96):
    """A ball's colours over its longitude and latitude: a disc with the number on two sides, and a band if it is a striped one."""

    def pixel(x, y):
        phi, theta = 2 * math.pi * (x + 0.5) / width, math.pi * (y + 0.5) / height
        colour = COLOURS[number if number <= 8 else number - 8]
        direction = (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
        edge = (abs(direction[2]) - 0.56) * height / 2.6
        base = colour if number <= 8 else mix(colour, IVORY, min(1.0, max(0.0, 0.5 + edge)))
        facing = abs(direction[0])
        s, t = direction[1] * math.copysign(1.0, direction[0]), direction[2]  # on the disc, upright from outside
        r = math.hypot(s, t)
        if r > 0.5 or facing < 0.5:
            return base
        inside = min(1.0, max(0.0, 0.5 + (0.40 - r) * width / 6.3))
        digits = [int(d) for d in str(number)]
        ink = 0.0
        for k, digit in enumerate(digits):
            shift = (k - (len(digits) - 1) / 2) * 0.21
            p = ((s - shift) / 0.16 + 0.5, t / 0.17 + 1.0)
            gap = min(distance_to_stroke(p, chain) for chain in DIGITS[digit]) * 0.165 - 0.030
            ink = max(ink, min(1.0, max(0.0, 0.5 - gap * width / 6.3)))
        return mix(base, mix(IVORY, (0.05, 0.05, 0.05), ink), inside)

    return pixel


def felt(x, y, size=128):
    """Worsted cloth: a faint twill of two greens."""
    weave = 0.5 + 0.5 * math.sin(2 * math.pi * (x + y) * 8 / size)
    cloud = noise(6 * x / size, 6 * y / size, 6, 6, 4)
    speck = noise(x / 2, y / 2, size // 2, size // 2, 7)
    return mix((0.055, 0.305, 0.245), (0.085, 0.385, 0.315), round((0.3 * weave + 0.4 * cloud + 0.3 * speck) * 20) / 20)


def mahogany(x, y, size=192):
    u, v = x / size, y / size
    bend = noise(u * 2, v * 5, 2, 5, 1)
    rings = 0.5 + 0.5 * math.sin(2 * math.pi * (8 * v + 1.4 * bend))
    fine = noise(u * 6, v * 90, 6, 90, 3)
    return mix((0.24, 0.085, 0.045), (0.46, 0.20, 0.11), round((0.5 * rings + 0.5 * fine) * 20) / 20)


def lamp_shade():
    """A bell of spun metal, radius 1 at its open lower edge, height 0.9: outer and inner wall."""
    steps = [i / 18 for i in range(19)]
    inner = [(0.08 + 0.92 * (1 - (1 - s) ** 2) ** 0.5, 0.86 * (1 - s)) for s in steps]  # from the top downwards: faces the axis
    outer = [(r + 0.03, z + 0.035) for r, z in inner][::-1]
    return revolve([outer, [inner[-1], outer[0]]], 64), revolve([inner], 64)


def cushion(length):
    """A rubber nose under cloth along x, of length `length`, its nose towards -y at height 0.036, cut at 45 degrees for the pockets."""
    section = [(0.055, 0.0), (0.012, 0.012), (0.0, 0.036), (0.006, 0.041), (0.055, 0.044)]
    mesh = Mesh()
    for (y0, z0), (y1, z1) in zip(section, section[1:]):
        n = (0.0, -(z1 - z0), y1 - y0)
        row = []
        for x in (-1, 1):
            for y, z in ((y0, z0), (y1, z1)):
                row.append(mesh.add_vertex((x * (length / 2 - 0.05 + 0.7 * y), y, z), n, (x * length * 2, y * 4)))
        mesh.add_quad(row[0], row[2], row[3], row[1])
    for x in (-1, 1):
        cap = [mesh.add_vertex((x * (length / 2 - 0.05 + 0.7 * y), y, z), (x, -0.7, 0)) for y, z in section]
        for k in range(1, len(cap) - 1):
            mesh.triangles.append((cap[0], cap[k], cap[k + 1]) if x > 0 else (cap[0], cap[k + 1], cap[k]))
    return mesh


def corner():
    """The metal cap around a corner pocket: a quarter of a thick ring."""
    path = [(0.075 * math.cos(t), 0.075 * math.sin(t), 0.0) for t in [math.pi * (0.25 + 1.5 * (i / 24 - 0.5)) for i in range(25)]]
    return tube(path, [0.022] * 25, 14)


def cue():
    """A cue of length 1.45 along z, tip at the origin: ferrule and tip, shaft, dark butt."""
    shaft = revolve([[(0.0065, 0.03), (0.0095, 0.75)]], 20)
    tip = revolve([[(0.0, 0.0), (0.0045, 0.0015), (0.0064, 0.006), (0.0064, 0.03)]], 20)
    butt = revolve([[(0.0097, 0.75), (0.0148, 1.44), (0.012, 1.45), (0.0, 1.45)]], 20)
    return shaft, tip, butt


def main():
    models, textures = HERE / "models", HERE / "textures"
    models.mkdir(exist_ok=True)
    textures.mkdir(exist_ok=True)
    outer, inner = lamp_shade()
    shaft, tip, butt = cue()
    meshes = {"shade_outer": outer, "shade_inner": inner, "cue_shaft": shaft, "cue_tip": tip, "cue_butt": butt, "corner": corner()}
    for name, mesh in meshes.items():
        write_ply(models / f"{name}.ply", mesh)
    write_ply(models / "cushion_long.ply", cushion(1.15), uvs=True)
    write_ply(models / "cushion_short.ply", cushion(1.10), uvs=True)
    write_ply(models / "rail_long.ply", rounded_box((2.60, 0.13, 0.10), 0.012, texture_scale=1.6), uvs=True)
    write_ply(models / "rail_short.ply", rounded_box((0.13, 1.44, 0.10), 0.012, texture_scale=1.6), uvs=True)
    for number in range(1, 16):
        write_png(textures / f"ball_{number:02}.png", 192, 96, ball_paint(number))
    write_png(textures / "felt.png", 128, 128, felt)
    write_png(textures / "mahogany.png", 192, 192, mahogany)


if __name__ == "__main__":
    main()
