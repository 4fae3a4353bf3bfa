"""PNG and Radiance HDR files and a little noise, in pure Python, for the textures of the project's scenes."""

import math
import struct
import zlib


def write_png(path, width, height, pixel):
    """8-bit RGB (or gray) PNG; `pixel(x, y)` gives values in [0, 1] as they are stored, y downwards."""
    rows = [[pixel(x, y) for x in range(width)] for y in range(height)]
    gray = not isinstance(rows[0][0], tuple)

    def byte(value):
        return min(255, max(0, int(value * 255 + 0.5)))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    scanlines = b"".join(
        b"\0" + bytes([byte(v) for v in row] if gray else [byte(c) for v in row for c in v]) for row in rows
    )
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n")
        out.write(chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0 if gray else 2, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(scanlines, 9)) + chunk(b"IEND", b""))


def write_hdr(path, width, height, pixel):
    """Radiance RGBE picture, not compressed; `pixel(x, y)` gives linear RGB, y downwards."""
    with open(path, "wb") as out:
        out.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode())
        for y in range(height):
            for x in range(width):
                rgb = pixel(x, y)
                largest = max(rgb)
                if largest < 1e-32:
                    out.write(b"\0\0\0\0")
                    continue
                mantissa, exponent = math.frexp(largest)
                scale = mantissa * 256 / largest
                out.write(bytes([*(min(255, int(c * scale)) for c in rgb), exponent + 128]))


def hash01(*keys):
    """A repeatable number in [0, 1) from integers."""
    h = 0x811C9DC5
    for key in keys:
        h = ((h ^ (key & 0xFFFFFFFF)) * 0x9E3779B1) & 0xFFFFFFFF
        h = (h ^ (h >> 15)) * 0x85EBCA77 & 0xFFFFFFFF
        h ^= h >> 13
    return h / 2**32


def noise(x, y, period_x, period_y, seed=0):
    """Value noise in [0, 1] that repeats after `period_x` and `period_y` lattice cells."""
    ix, iy = math.floor(x), math.floor(y)
    fx, fy = x - ix, y - iy
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)

    def at(i, j):
        return hash01((ix + i) % period_x, (iy + j) % period_y, seed)

    low = at(0, 0) * (1 - fx) + at(1, 0) * fx
    high = at(0, 1) * (1 - fx) + at(1, 1) * fx
    return low * (1 - fy) + high * fy


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))
