#!/usr/bin/env python3
"""Writes the meshes and textures of scene.xml (pure Python, some seconds): `python3 make.py`."""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tools"))

from images import hash01, mix, noise, write_hdr, write_png  # noqa: E402
from meshes import Mesh, height_sheet, revolve, rounded_box, spline, tube, write_ply  # noqa: E402


def kettle():
    """Body, lid and spout of the copper kettle; its brass handle; the wooden grip."""
    body = spline([(0.088, 0.0), (0.108, 0.022), (0.118, 0.06), (0.104, 0.105), (0.066, 0.134), (0.058, 0.139)], 4)
    rim = [(0.058, 0.139), (0.061, 0.143), (0.060, 0.147)]
    lid = spline([(0.060, 0.147), (0.048, 0.158), (0.024, 0.168), (0.010, 0.171)], 3)
    base = [(0.0, 0.0), (0.088, 0.0)]
    copper = revolve([base, body, rim, lid], 36)
    spout = spline([(0.085, 0, 0.048), (0.135, 0, 0.062), (0.160, 0, 0.100), (0.178, 0, 0.142), (0.204, 0, 0.160)], 3)
    radii = [0.027 - 0.0165 * (i / (len(spout) - 1)) ** 0.7 for i in range(len(spout))]
    copper = copper.merged(tube(spout, radii, 12))

    knob = spline([(0.008, 0.168), (0.006, 0.177), (0.014, 0.186), (0.013, 0.195), (0.0, 0.199)], 3)
    arc = [(0.088 * math.cos(t), 0, 0.118 + 0.155 * math.sin(t)) for t in [math.pi * i / 16 for i in range(17)]]
    brass = revolve([knob], 16).merged(tube(arc, [0.0055] * 17, 8, flatten=1.7))
    top = [(0.088 * math.cos(t), 0, 0.118 + 0.155 * math.sin(t)) for t in [math.pi * (0.3 + 0.4 * i / 8) for i in range(9)]]
    grip = tube(top, [0.008 + 0.006 * math.sin(math.pi * i / 8) ** 0.6 for i in range(9)], 10)
    return copper, brass, grip


def carafe():
    """A carafe blown from glass: outer and inner wall as one closed surface."""
    outer = spline([(0.048, 0.0), (0.060, 0.012), (0.067, 0.055), (0.056, 0.110), (0.030, 0.155), (0.026, 0.185),
                    (0.036, 0.222)], 3)
    lip = [(0.036, 0.222), (0.0350, 0.2232), (0.0338, 0.222)]
    inner = spline([(0.0338, 0.222), (0.0235, 0.185), (0.0272, 0.155), (0.0530, 0.110), (0.0640, 0.056), (0.0565, 0.020),
                    (0.040, 0.012), (0.0, 0.010)], 3)
    return revolve([[(0.0, 0.0), (0.048, 0.0)], outer, lip, inner], 40)


def tumbler():
    """A glass with a thick base."""
    outer = [(0.030, 0.0), (0.033, 0.003), (0.0395, 0.092)]
    lip = [(0.0395, 0.092), (0.0388, 0.0932), (0.0380, 0.092)]
    inner = [(0.0380, 0.092), (0.0325, 0.022), (0.029, 0.0165), (0.0, 0.015)]
    return revolve([[(0.0, 0.0), (0.030, 0.0)], outer, lip, inner], 36)


def bowl():
    """A brass bowl on a foot."""
    foot = [(0.0, 0.004), (0.040, 0.004), (0.046, 0.0), (0.049, 0.002), (0.044, 0.010)]
    outer = spline([(0.044, 0.010), (0.080, 0.020), (0.112, 0.048), (0.124, 0.083)], 4)
    lip = [(0.124, 0.083), (0.1255, 0.0855), (0.122, 0.0855), (0.1205, 0.083)]
    inner = spline([(0.1205, 0.083), (0.1080, 0.049), (0.077, 0.024), (0.040, 0.014), (0.0, 0.012)], 3)
    return revolve([foot, outer, lip, inner], 40)


def pear():
    body = spline([(0.0, 0.004), (0.016, 0.0), (0.034, 0.016), (0.037, 0.034), (0.026, 0.062), (0.0165, 0.080),
                   (0.010, 0.091), (0.0, 0.0925)], 3)
    return revolve([body], 24)


def stem():
    path = spline([(0.0, 0, 0.088), (0.001, 0, 0.100), (0.006, 0.001, 0.116)], 3)
    return tube(path, [0.0016] * (len(path) - 1) + [0.0026], 7)


def lemon():
    body = spline([(0.0, -0.043), (0.006, -0.039), (0.017, -0.031), (0.0275, -0.012), (0.0280, 0.010), (0.018, 0.030),
                   (0.007, 0.039), (0.0, 0.0425)], 3)
    return revolve([body], 22)


def candlestick():
    base = spline([(0.0, 0.0), (0.046, 0.0), (0.050, 0.005), (0.034, 0.014), (0.012, 0.026), (0.010, 0.040)], 2)
    shaft = spline([(0.010, 0.040), (0.017, 0.052), (0.009, 0.064), (0.0075, 0.130), (0.012, 0.148), (0.0085, 0.158)], 3)
    cup = spline([(0.0085, 0.158), (0.024, 0.166), (0.0265, 0.171), (0.017, 0.174), (0.016, 0.200), (0.0, 0.200)], 2)
    return revolve([base, shaft, cup], 22)


def candle():
    wick = [(0.0012, 0.282), (0.0012, 0.294), (0.0, 0.294)]
    return revolve([spline([(0.0125, 0.198), (0.0112, 0.274), (0.0095, 0.282), (0.0060, 0.280), (0.0012, 0.282)], 2), wick], 16)


def band():
    """A wide polished ring that stands on the table: light bundles to a heart inside."""
    outer = [(0.0385, 0.0), (0.0400, 0.0015), (0.0400, 0.0285), (0.0385, 0.030)]
    inner = [(0.0385, 0.030), (0.0370, 0.0285), (0.0370, 0.0015), (0.0385, 0.0)]
    return revolve([outer[:2], outer[1:3], outer[2:], inner[:2], inner[1:3], inner[2:]], 48)


def jar(points, steps=3, segments=32):
    inner = [(points[-1][0] - 0.006, points[-1][1]), (points[-1][0] - 0.010, points[-1][1] - 0.03), (0.0, points[-1][1] - 0.04)]
    return revolve([[(0.0, 0.0), points[0]], spline(points, steps), [points[-1], inner[0]], inner], segments)


def branch():
    """A few dry stems for the vase, with leaves like coins; woody parts and leaves apart."""
    wood, leaves = Mesh(), Mesh()
    for b in range(5):
        turn, lean, reach = 2.4 * b + 0.5, 0.22 + 0.20 * hash01(b, 1), 0.40 + 0.22 * hash01(b, 2)
        points = []
        for i in range(6):
            s = i / 5
            r = lean * reach * (s + 1.2 * s * s)
            points.append((r * math.cos(turn + 0.5 * s), r * math.sin(turn + 0.5 * s), 0.02 + reach * s))
        path = spline(points, 2)
        wood = wood.merged(tube(path, [0.0024 - 0.0016 * i / (len(path) - 1) for i in range(len(path))], 6))
        for i in range(4, len(path)):
            for side in (-1, 1):
                size = 0.016 + 0.010 * hash01(b, i, side + 5)
                leaf = coin_leaf(size, 0.5 * (hash01(b, i, side + 9) - 0.5))
                leaf = leaf.rotated(1, 25 + 50 * hash01(b, i, side + 13)).rotated(2, math.degrees(turn) + side * 75)
                leaves = leaves.merged(leaf.moved(*path[i]))
    return wood, leaves


def coin_leaf(size, curl):
    """A round leaf with its stalk at the origin, lying along +x, smooth over a little fan of triangles."""
    mesh = Mesh()
    centre = mesh.add_vertex((size, 0, curl * size * 0.4), (0, 0, 1), (0.5, 0.5))
    rim = []
    for k in range(10):
        c, s = math.cos(2 * math.pi * k / 10), math.sin(2 * math.pi * k / 10)
        rim.append(mesh.add_vertex((size * (1 + c), 0.82 * size * s, 0), (0.35 * curl * c, 0.35 * curl * s, 1), (c, s)))
    mesh.triangles += [(centre, rim[k], rim[(k + 1) % 10]) for k in range(10)]
    return mesh


def panelled_door(width, height, thickness):
    """Leaf with four raised panels on both faces, hinge on the z axis, reaching to +x."""
    door = rounded_box((width, thickness, height), 0.004).moved(width / 2, 0, height / 2)
    for x0, x1 in ((0.11, width / 2 - 0.045), (width / 2 + 0.045, width - 0.11)):
        for z0, z1 in ((0.20, 0.86), (1.04, height - 0.13)):
            for side in (-1, 1):
                panel = rounded_box((x1 - x0, 0.024, z1 - z0), 0.010)
                frame = rounded_box((x1 - x0 - 0.10, 0.024, z1 - z0 - 0.10), 0.011)
                y = side * thickness / 2
                door = door.merged(panel.moved((x0 + x1) / 2, y, (z0 + z1) / 2), frame.moved((x0 + x1) / 2, y + side * 0.009,
                                                                                             (z0 + z1) / 2))
    return door


def door_handle():
    rose = revolve([[(0.0, 0.0), (0.026, 0.0), (0.026, 0.006), (0.018, 0.009), (0.0, 0.009)]], 20)
    path = spline([(0, 0, 0.0), (0, 0, 0.045), (-0.010, 0, 0.056), (-0.12, 0, 0.058)], 4)
    return rose.merged(tube(path, [0.0085] * len(path), 12)).rotated(0, 90)


def table():
    """Top, and the frame with four tapered legs."""
    top = rounded_box((1.64, 0.92, 0.034), 0.007, texture_scale=1.15).moved(z=0.733)
    frame = rounded_box((1.46, 0.022, 0.085), 0.003).moved(0, -0.37, 0.672)
    frame = frame.merged(rounded_box((1.46, 0.022, 0.085), 0.003).moved(0, 0.37, 0.672))
    for x in (-0.73, 0.73):
        frame = frame.merged(rounded_box((0.022, 0.74, 0.085), 0.003).moved(x, 0, 0.672))
        for y in (-0.37, 0.37):
            frame = frame.merged(tube([(x, y, 0.0), (x, y, 0.716)], [0.020, 0.034], 4))
    return top, frame


def books(sizes):
    """For each book its cover (two boards and a rounded spine) and its block of pages, around the origin, spine at -x."""
    result = []
    for w, d, h in sizes:
        boards = rounded_box((w, d, 0.004), 0.0015).moved(0, 0, h / 2 - 0.002)
        boards = boards.merged(rounded_box((w, d, 0.004), 0.0015).moved(0, 0, -h / 2 + 0.002))
        arc = [math.pi * (0.5 + i / 10) for i in range(11)]
        spine = Mesh()
        for y in (-d / 2, d / 2):
            for t in arc:
                spine.add_vertex((-w / 2 + 0.012 * math.cos(t), y, h / 2 * math.sin(t)), (math.cos(t), 0, math.sin(t)))
        for i in range(10):
            spine.add_quad(i, 11 + i, 12 + i, i + 1)
        pages = rounded_box((w - 0.008, d - 0.010, h - 0.008), 0.0004).moved(-0.002)
        result.append((boards.merged(spine), pages))
    return result


def curtain():
    def depth(u, v):
        gather = 1.0 - 0.35 * v
        return 0.034 * gather * (math.sin(2 * math.pi * 5 * u + 0.9 * v) + 0.45 * math.sin(2 * math.pi * 11 * u + 2.0 + 1.7 * v))

    return height_sheet(0.52, 2.35, depth, 66, 4)


# Textures. Colours are as stored (sRGB).


def floor_boards(x, y, size=256, boards=8):
    """Oak boards along v; each is cut from other wood."""
    u, v = x / size * boards, y / size
    board = int(u)
    start = hash01(board, 7)
    piece = int(math.floor(2 * (v + start)))
    along = 2 * (v + start) - piece
    tone = hash01(board, piece % 2, 3)
    grain = noise(u * 14, v * 5, 14 * boards, 5, 11 + board + 17 * (piece % 2))
    fine = noise(u * 34, v * 11, 34 * boards, 11, 50 + board)
    knot = noise(u * 3, v * 6, 3 * boards, 6, 90)
    rings = 0.5 + 0.5 * math.sin(2 * math.pi * (3.0 * grain + 1.6 * knot))
    value = 0.35 * tone + 0.40 * rings + 0.25 * fine
    edge = min(u - board, board + 1 - u) * size / boards
    gap = 1.0 if edge < 0.8 or min(along, 1 - along) * size / 2 < 0.8 else 0.0
    colour = mix((0.36, 0.235, 0.145), (0.60, 0.43, 0.285), round(value * 20) / 20)
    return mix(colour, (0.10, 0.065, 0.04), 0.85 * gap)


def walnut(x, y, width=384, height=256):
    """Dark figured wood, grain along u."""
    u, v = x / width, y / height
    bend = noise(u * 3, v * 4, 3, 4, 1) + 0.5 * noise(u * 6, v * 9, 6, 9, 2)
    rings = 0.5 + 0.5 * math.sin(2 * math.pi * (7 * v + 1.5 * bend))
    fine = noise(u * 14, v * 96, 14, 96, 3)
    value = 0.55 * rings + 0.45 * fine
    return mix((0.34, 0.205, 0.125), (0.60, 0.40, 0.25), round(value * 22) / 22)


def warped_grid(x, y, width=240, height=300):
    """The print on the wall: a square grid, bent by a map that gathers its lines around two places."""
    ink, paper = (0.12, 0.20, 0.27), (0.90, 0.86, 0.77)
    u, v = (x + 0.5) / width, (y + 0.5) / height
    if not (0.12 < u < 0.88 and 0.12 < v < 0.88):
        return paper
    s, t = (u - 0.12) / 0.76, (v - 0.12) / 0.76

    def bend(a, b):
        for cx, cy, strength, radius in ((0.34, 0.62, 0.55, 0.33), (0.72, 0.26, -0.42, 0.26)):
            dx, dy = a - cx, b - cy
            pull = strength * math.exp(-(dx * dx + dy * dy) / (radius * radius))
            a, b = a + pull * dx, b + pull * dy
        return a, b

    e = 1 / width
    a, b = bend(s, t)
    ax, bx = (p - q for p, q in zip(bend(s + e, t), bend(s - e, t)))
    ay, by = (p - q for p, q in zip(bend(s, t + e), bend(s, t - e)))
    cover = 0.0
    for value, slope in ((a, math.hypot(ax, ay)), (b, math.hypot(bx, by))):
        cells = value * 11
        distance = abs(cells - round(cells)) / (11 * max(slope, 1e-6) / 2)  # in pixels
        cover = max(cover, min(1.0, max(0.0, 1.25 - distance)))
    return mix(paper, ink, round(cover * 6) / 6)


def dusk(x, y, width=64, height=32):
    """Sky after sunset: blue overhead, a warm band low in the west; dark land below."""
    elevation = math.pi * (0.5 - (y + 0.5) / height)
    azimuth = 2 * math.pi * (x + 0.5) / width
    west = 0.5 + 0.5 * math.cos(azimuth - 1.2)
    if elevation < 0:
        return (0.020, 0.022, 0.028)
    s = math.sin(elevation)
    sky = mix((0.62, 0.80, 1.10), (0.16, 0.30, 0.66), s**0.55)
    glow = math.exp(-s / 0.16) * (0.25 + 0.75 * west)
    return tuple(c + glow * g for c, g in zip(sky, (1.5, 0.75, 0.28)))


def main():
    models, textures = HERE / "models", HERE / "textures"
    models.mkdir(exist_ok=True)
    textures.mkdir(exist_ok=True)
    copper, brass, grip = kettle()
    wood, leaves = branch()
    top, frame = table()
    meshes = {
        "kettle": copper, "kettle_handle": brass, "kettle_grip": grip, "carafe": carafe(), "tumbler": tumbler(), "bowl": bowl(),
        "pear": pear(), "stem": stem(), "lemon": lemon(), "candlestick": candlestick(), "candle": candle(), "band": band(),
        "vase": jar([(0.045, 0.0), (0.075, 0.03), (0.088, 0.09), (0.070, 0.16), (0.032, 0.21), (0.030, 0.235), (0.038, 0.25)]),
        "jar": jar([(0.050, 0.0), (0.058, 0.02), (0.058, 0.10), (0.046, 0.128), (0.048, 0.135)], 2),
        "branch": wood, "leaves": leaves, "door": panelled_door(0.86, 2.03, 0.040), "door_handle": door_handle(),
        "table_frame": frame, "curtain": curtain(),
    }  # fmt: skip
    for i, (cover, pages) in enumerate(books([(0.17, 0.24, 0.036), (0.155, 0.225, 0.028), (0.14, 0.205, 0.022)]), 1):
        meshes[f"book{i}_cover"], meshes[f"book{i}_pages"] = cover, pages
    for name, mesh in meshes.items():
        write_ply(models / f"{name}.ply", mesh)
    write_ply(models / "table_top.ply", top, uvs=True)
    write_png(textures / "boards.png", 256, 256, floor_boards)
    write_png(textures / "walnut.png", 384, 256, walnut)
    write_png(textures / "print.png", 240, 300, warped_grid)
    write_hdr(textures / "dusk.hdr", 64, 32, dusk)


if __name__ == "__main__":
    main()
