#!/usr/bin/env python3
"""Writes the meshes and the texture of scene.xml (pure Python, some seconds): `python3 make.py`."""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tools"))

from images import mix, noise, write_png  # noqa: E402
from meshes import Mesh, revolve, spline, write_ply  # noqa: E402

SEGMENTS = 96


def band():
    """A wide ring of radius 1, polished inside and out, that stands on the table: light bundles to a heart inside."""
    outer, inner, height, bevel = 1.05, 0.97, 0.62, 0.03
    walls = [
        [(outer, bevel), (outer, height - bevel)],
        [(outer, height - bevel), (outer - bevel, height), (inner + bevel, height), (inner, height - bevel)],
        [(inner, height - bevel), (inner, bevel)],
        [(inner, bevel), (inner + bevel, 0.0), (outer - bevel, 0.0), (outer, bevel)],
    ]
    return revolve([walls[0], walls[1], walls[2], walls[3]], SEGMENTS)


def domed_ring():
    """A ring with a round back, like a wedding ring: radius 1 inside, lying flat."""
    section = [(1.0 + 0.30 * math.sin(t) ** 0.8 * 0.75, 0.22 - 0.22 * math.cos(t)) for t in [math.pi * i / 12 for i in range(13)]]
    outer = [(r, z) for r, z in section]
    inner = [(1.0, 0.44), (0.985, 0.33), (0.98, 0.22), (0.985, 0.11), (1.0, 0.0)]
    return revolve([outer, inner], SEGMENTS)


def wire_ring():
    """A thin ring of round wire: radius 1, thickness 0.16."""
    angles = [2 * math.pi * i / 14 - math.pi / 2 for i in range(15)]
    return revolve([[(1.0 + 0.08 * math.cos(t), 0.08 + 0.08 * math.sin(t)) for t in angles]], SEGMENTS)


def coin():
    """Radius 1, thickness 0.14: a raised rim, beads along it, and a rose of twelve petals in the middle; both faces alike."""
    thickness, rings = 0.14, 22

    def height(r, phi):
        rim = 0.020 / (1 + math.exp((0.90 - r) / 0.008))
        beads = 0.010 * math.exp(-(((r - 0.82) / 0.025) ** 2)) * (0.5 + 0.5 * math.cos(36 * phi))
        petals = 0.022 * math.exp(-(((r - 0.40 - 0.12 * math.cos(12 * phi)) / 0.10) ** 2))
        heart = 0.020 * math.exp(-((r / 0.11) ** 2))
        return rim + beads + petals + heart

    mesh = Mesh()
    radii = [0.0] + [0.965 * ((i + 1) / rings) ** 0.85 for i in range(rings)]
    for side in (1, -1):
        grid = []
        for r in radii:
            row = []
            for k in range(SEGMENTS + 1):
                phi, e = 2 * math.pi * k / SEGMENTS, 1e-3
                dr = (height(r + e, phi) - height(abs(r - e), phi)) / (2 * e) if r > 0 else 0.0
                dphi = (height(r, phi + e) - height(r, phi - e)) / (2 * e * max(r, 1e-2)) if r > 0 else 0.0
                c, s = math.cos(phi), math.sin(phi)
                normal = (-(dr * c - dphi * s), -(dr * s + dphi * c), 1.0)
                z = thickness / 2 - 0.02 + height(r, phi)
                row.append(mesh.add_vertex((r * c, r * s, side * z + thickness / 2), (normal[0], normal[1], side * normal[2])))
            grid.append(row)
        for a, b in zip(grid, grid[1:]):
            for k in range(SEGMENTS):
                quad = (a[k], b[k], b[k + 1], a[k + 1])
                mesh.add_quad(*(quad if side > 0 else quad[::-1]))
    edge = [(0.965, 0.0), (0.99, 0.004), (1.0, 0.015)]
    wall = [(1.0, 0.015), (1.0, thickness - 0.015)]
    top = [(1.0, thickness - 0.015), (0.99, thickness - 0.004), (0.965, thickness)]
    return mesh.merged(revolve([edge, wall, top], SEGMENTS))


def table():
    """A round top with a moulded edge, radius 30 and 2.4 thick, upper face at z = 0."""
    edge = spline([(30.0, 0.0), (30.5, -0.25), (30.5, -0.8), (29.6, -1.3), (29.4, -1.7), (29.0, -2.4)], 2)
    mesh = revolve([edge[::-1], [(30.0, 0.0), (0.0, 0.0)]], 72)
    mesh.uvs = [(p[0] / 61 + 0.5, p[1] / 61 + 0.5) for p in mesh.positions]
    return mesh


def maple(x, y, size=384):
    """Pale wood in eight wedges whose grain runs outwards, and a dark ring inlaid near the edge."""
    u, v = 2 * (x + 0.5) / size - 1, 2 * (y + 0.5) / size - 1
    r, phi = math.hypot(u, v), math.atan2(v, u) / (2 * math.pi) + 0.5
    wedge = int(8 * phi) % 8
    axis = 2 * math.pi * (wedge + 0.5) / 8 - math.pi
    along, across = u * math.cos(axis) + v * math.sin(axis), v * math.cos(axis) - u * math.sin(axis)
    grain = noise(along * 3 + 20, across * 26 + 80, 64, 256, wedge)
    fine = noise(along * 9 + 40, across * 90 + 200, 128, 1024, wedge + 9)
    value = round((0.62 * grain + 0.38 * fine) * 18) / 18
    colour = mix((0.62, 0.50, 0.36), (0.80, 0.69, 0.53), value)
    if 0.905 < r < 0.925 or 0.885 < r < 0.890:
        colour = mix(colour, (0.16, 0.09, 0.05), 0.9)
    seam = min((8 * phi) % 1, 1 - (8 * phi) % 1) / 8 * 2 * math.pi * r * size / 2
    return mix(colour, (0.36, 0.25, 0.15), 0.6 if seam < 0.7 else 0.0)


def main():
    models, textures = HERE / "models", HERE / "textures"
    models.mkdir(exist_ok=True)
    textures.mkdir(exist_ok=True)
    for mesh in (band, domed_ring, wire_ring, coin):
        write_ply(models / f"{mesh.__name__}.ply", mesh())
    write_ply(models / "table.ply", table(), uvs=True)
    write_png(textures / "maple.png", 384, 384, maple)


if __name__ == "__main__":
    main()
