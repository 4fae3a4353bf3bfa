#!/usr/bin/env python3
"""Writes assets/: the small meshes and pictures of the test scenes. Pure Python; the JPEG needs oiiotool."""

import math
import struct
import subprocess
import sys
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "scenes" / "tools"))

from images import hash01, mix, noise, write_hdr, write_png  # noqa: E402
from meshes import revolve, spline, write_obj, write_ply  # noqa: E402

ASSETS = HERE / "assets"


def bottle():
    body = spline([(0.55, 0.0), (0.62, 0.25), (0.58, 0.8), (0.22, 1.25), (0.20, 1.55), (0.28, 1.75)], 3)
    return revolve([[(0.0, 0.0), (0.55, 0.0)], body, [(0.28, 1.75), (0.0, 1.80)]], 20)


def write_house(path):
    """Quads and triangles with neither normals nor texture coordinates."""
    corners = [(-0.8, -0.6, 0), (0.8, -0.6, 0), (0.8, -0.6, 0.9), (0, -0.6, 1.5), (-0.8, -0.6, 0.9)]
    back = [(x, 0.6, z) for x, _, z in corners]
    lines = ["# a house"] + [f"v {x} {y} {z}" for x, y, z in corners + back]
    lines += ["f 1 2 3 5", "f 3 4 5", "f 7 6 10 8", "f 8 10 9"]
    lines += [f"f {i + 1} {i + 6} {(i + 1) % 5 + 6} {(i + 1) % 5 + 1}" for i in range(5)]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def write_serialized(path, meshes):
    """Mitsuba's .serialized, version 4: each mesh a zlib stream, then the table of where they begin."""
    offsets = []
    with open(path, "wb") as out:
        for number, mesh in enumerate(meshes):
            offsets.append(out.tell())
            has_uvs = number == 0  # the second one stores double precision and no texture coordinates
            flags = 0x0001 | (0x0002 if has_uvs else 0) | (0x1000 if has_uvs else 0x2000)
            kind = "f" if has_uvs else "d"
            data = struct.pack("<I", flags) + f"mesh {number}".encode() + b"\0"
            data += struct.pack("<QQ", len(mesh.positions), len(mesh.triangles))
            for values in (mesh.positions, mesh.normals) + ((mesh.uvs,) if has_uvs else ()):
                data += b"".join(struct.pack(f"<{len(v)}{kind}", *v) for v in values)
            data += b"".join(struct.pack("<3I", *t) for t in mesh.triangles)
            out.write(struct.pack("<HH", 0x041C, 4) + zlib.compress(data, 9))
        out.write(b"".join(struct.pack("<Q", o) for o in offsets) + struct.pack("<I", len(offsets)))


def write_exr(path, width, height, pixel):
    """OpenEXR: one part, scan lines, float channels B, G, R, not compressed."""

    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data

    channels = b"".join(c + b"\0" + struct.pack("<IIII", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<II", 20000630, 2)
    header += attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\0")
    header += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    header += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    size = 8 + 12 * width
    first = len(header) + 8 * height
    with open(path, "wb") as out:
        out.write(header + b"".join(struct.pack("<Q", first + y * size) for y in range(height)))
        for y in range(height):
            row = [pixel(x, y) for x in range(width)]
            out.write(struct.pack("<iI", y, 12 * width))
            out.write(b"".join(struct.pack(f"<{width}f", *(p[c] for p in row)) for c in (2, 1, 0)))


def write_png_as(path, width, height, color_type, depth, rows, extra=b""):
    """PNG of any kind from packed rows; `extra` are chunks before the data."""
    data = b"".join(b"\0" + row for row in rows)
    header = struct.pack(">IIBBBBB", width, height, depth, color_type, 0, 0, 0)
    chunks = png_chunk(b"IHDR", header) + extra + png_chunk(b"IDAT", zlib.compress(data, 9)) + png_chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def png_chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def tiles(x, y):
    """Few large pixels, each another colour, brighter to the top right so that a flip shows."""
    base = (0.25 + 0.6 * hash01(x, y, 1), 0.2 + 0.5 * hash01(x, y, 2), 0.2 + 0.5 * hash01(x, y, 3))
    return mix(base, (0.9, 0.85, 0.3), 0.5 * (x / 7) * (1 - y / 5))


def bump_height(x, y, size=64):
    u, v = 2 * math.pi * (x + 0.5) / size, 2 * math.pi * (y + 0.5) / size
    return 0.5 + 0.25 * math.sin(3 * u) * math.sin(2 * v) + 0.2 * math.sin(u + 2 * v)


def normal_map(x, y, size=64):
    dx = 3.0 * (bump_height(x + 1, y) - bump_height(x - 1, y))
    dy = 3.0 * (bump_height(x, y - 1) - bump_height(x, y + 1))
    length = math.sqrt(dx * dx + dy * dy + 1)
    return (0.5 - 0.5 * dx / length, 0.5 - 0.5 * dy / length, 0.5 + 0.5 / length)


def sky(x, y, width=32, height=16):
    """A broad sun over a sky that turns from horizon to zenith; dim below."""
    theta, phi = math.pi * (y + 0.5) / height, 2 * math.pi * (x + 0.5) / width
    up = math.cos(theta)
    colour = mix((0.55, 0.5, 0.45), (0.2, 0.35, 0.7), max(up, 0) ** 0.5) if up > 0 else (0.12, 0.1, 0.09)
    direction = (math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi))
    sun = math.exp(12 * (sum(a * b for a, b in zip(direction, (0.5, 0.62, 0.605))) - 1))
    return tuple(c + 7 * sun * s for c, s in zip(colour, (1.0, 0.85, 0.6)))


def main():
    ASSETS.mkdir(exist_ok=True)
    mesh = bottle()
    write_obj(ASSETS / "bottle.obj", mesh)
    write_obj(ASSETS / "bottle_bare.obj", mesh, normals=False, uvs=False)
    write_ply(ASSETS / "bottle.ply", mesh, uvs=True)
    write_ply(ASSETS / "bottle_ascii.ply", mesh, uvs=True, ascii=True)
    write_ply(ASSETS / "bottle_bare.ply", mesh, normals=False)
    write_house(ASSETS / "house.obj")
    # Every texture coordinate belongs to one point, as Mitsuba's sampling of textured emitters needs.
    shade = revolve([spline([(0.5, 0.2), (0.6, 0.8), (0.3, 1.4), (0.2, 1.7)], 3)], 20)
    write_obj(ASSETS / "shade.obj", shade)
    plate = revolve([spline([(0.0, 0.3), (0.5, 0.35), (0.8, 0.6), (0.95, 1.0)], 3)], 20)
    write_serialized(ASSETS / "two.serialized", [mesh, mesh.moved(0.4).merged(plate)])

    write_png(ASSETS / "tiles.png", 8, 6, tiles)
    write_png(ASSETS / "grey.png", 16, 12, lambda x, y: 0.1 + 0.8 * noise(x / 3, y / 3, 6, 4, 5))
    write_png(ASSETS / "bumps.png", 64, 64, bump_height)
    write_png(ASSETS / "normals.png", 64, 64, normal_map)
    ramp = [b"".join(struct.pack(">3H", x * 4369, y * 5461, 9000 + 40 * x * y) for x in range(16)) for y in range(12)]
    write_png_as(ASSETS / "ramp16.png", 16, 12, 2, 16, ramp)
    alpha = [bytes(b for x in range(8) for b in (*(int(255 * c) for c in tiles(x, y)), 40 + 25 * x)) for y in range(6)]
    write_png_as(ASSETS / "alpha.png", 8, 6, 6, 8, alpha)
    palette = bytes(int(255 * c) for i in range(8) for c in tiles(i, i % 6))
    rows = [bytes((x + 2 * y) % 8 for x in range(8)) for y in range(6)]
    write_png_as(ASSETS / "palette.png", 8, 6, 3, 8, rows, png_chunk(b"PLTE", palette))
    write_hdr(ASSETS / "linear.hdr", 8, 6, tiles)
    write_exr(ASSETS / "linear.exr", 8, 6, tiles)
    write_hdr(ASSETS / "lamp.hdr", 8, 6, lambda x, y: tuple(6 * c * c * c for c in tiles(x, y)))
    write_hdr(ASSETS / "sky.hdr", 32, 16, sky)
    write_exr(ASSETS / "sky.exr", 32, 16, sky)
    subprocess.run(["oiiotool", ASSETS / "tiles.png", "--resize:filter=box", "64x48", "-d", "uint8", "--compression",
                    "jpeg:95", "-o", ASSETS / "tiles.jpg"], check=True)  # fmt: skip


if __name__ == "__main__":
    main()
