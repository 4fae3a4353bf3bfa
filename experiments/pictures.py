"""Pictures out of a report of `warpath compare`: images side by side, and sample densities. Nothing but the standard library."""

import base64
import json
import math
import struct
import sys
import zlib

GAP = 6  # white pixels between two pictures


def page_data(folder):
    """What the report's page holds: images, densities, results."""
    text = (folder / "index.html").read_text(encoding="utf-8")
    start = text.index('<script type="application/json" id="data">')
    return json.loads(text[text.index(">", start) + 1 : text.index("</script>", start)])


def halves(picture):
    data = base64.b64decode(picture["halves"])
    return struct.unpack(f"<{len(data) // 2}e", data)


def srgb(value):
    value = min(1.0, max(0.0, value)) if math.isfinite(value) else 1.0
    return round(255 * (12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055))


def image_rows(picture, exposure=1.0, crop=None, zoom=1):
    """8-bit RGB rows of an image of the report; `crop` is (x, y, width, height) in shares of its size."""
    width, height, values = picture["width"], picture["height"], halves(picture)
    x, y, w, h = crop or (0, 0, 1, 1)
    columns = range(round(x * width), round((x + w) * width))
    rows = []
    for j in range(round(y * height), round((y + h) * height)):
        row = b"".join(bytes(srgb(exposure * values[3 * (j * width + i) + c]) for c in range(3)) * zoom for i in columns)
        rows += [row] * zoom
    return rows


def density_rows(picture, zoom=4):
    """Dark blue to yellow rows of a density; it is cut off at eight times its mean."""
    stops = ((0.06, 0.06, 0.20), (0.20, 0.25, 0.55), (0.55, 0.30, 0.55), (0.90, 0.45, 0.30), (1.0, 0.92, 0.55))
    width, values = picture["width"], halves(picture)
    rows = []
    for j in range(picture["height"]):
        row = b""
        for i in range(width):
            s = 4 * math.sqrt(min(1.0, values[j * width + i] / 8))
            k = min(3, int(s))
            row += bytes(round(255 * (a + (s - k) * (b - a))) for a, b in zip(stops[k], stops[k + 1])) * zoom
        rows += [row] * zoom
    return rows


def side_by_side(pictures):
    """Rows of pictures of equal height with a white gap between them."""
    return [(b"\xff" * (3 * GAP)).join(rows) for rows in zip(*pictures)]


def stacked(strips):
    """Rows of strips of equal width with a white gap between them."""
    gap = [b"\xff" * len(strips[0][0])] * GAP
    return [row for k, strip in enumerate(strips) for row in ([] if k == 0 else gap) + strip]


def write_png(path, rows):
    """8-bit RGB."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    scanlines = b"".join(b"\0" + row for row in rows)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(scanlines, 9)) + chunk(b"IEND", b""))
    print(f"picture: {path}", file=sys.stderr)


def images_of(folder, methods, **options):
    """Rows of each method's image in the report in `folder`, and of the reference at the end."""
    data = page_data(folder)
    by_method = {image["method"]: image for image in data["images"]}
    return [image_rows(by_method[method], **options) for method in methods] + [image_rows(data["reference"], **options)]


def write_comparison(folder, methods, zoom=1):
    """images.png: three methods' images and the reference, in two strips."""
    pictures = images_of(folder, methods, zoom=zoom)
    write_png(folder / "images.png", stacked([side_by_side(pictures[:2]), side_by_side(pictures[2:])]))


def densities_of(folder, methods, x, y):
    """Rows of the true density over two numbers (the candidates'), then of what each method learned of it."""
    found = {d["method"]: d for d in page_data(folder)["densities"] if (d["x_dimension"], d["y_dimension"]) == (x, y)}
    return [density_rows(found[methods[0]]["candidates"]), *(density_rows(found[method]["learned"]) for method in methods)]


def write_strip(folder, methods, crop, name="side-by-side.png"):
    """The same part of three images in a row: two methods and the reference."""
    write_png(folder / name, side_by_side(images_of(folder, methods, crop=crop)))
