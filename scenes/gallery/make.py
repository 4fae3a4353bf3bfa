#!/usr/bin/env python3
"""Writes what scene.xml includes (the hall with its exhibits, and its 93 lights), the meshes and the pictures on the walls:
`python3 make.py` (pure Python, some seconds).

The hall is 16 wide and 24 long. Six bays lie on each side of an aisle, with walls between them that end below the ceiling, and a
screen towards the aisle. A light in a bay is hidden from nearly all of the others.
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tools"))

from images import hash01, mix, noise, write_png  # noqa: E402
from meshes import revolve, rounded_box, spline, tube, write_ply  # noqa: E402

BAYS = [(side, row) for row in range(6) for side in (-1, 1)]  # side -1 is left of the aisle
DEPTH = 4.0  # of a bay along the hall
LIGHTS = 93


def middle(bay):
    """Of a bay's floor."""
    side, row = bay
    return 5.2 * side, DEPTH * (row + 0.5)


# Meshes


def amphora():
    body = spline([(0.055, 0.0), (0.07, 0.02), (0.05, 0.06), (0.13, 0.22), (0.165, 0.36), (0.12, 0.48), (0.055, 0.54), (0.05, 0.61), (0.08, 0.66)], 4)
    mesh = revolve([[(0.0, 0.0), body[0]], body, [body[-1], (0.065, 0.655), (0.04, 0.61), (0.0, 0.60)]], 40)
    for turn in (0, 180):
        path = spline([(0.05, 0, 0.60), (0.11, 0, 0.61), (0.15, 0, 0.54), (0.13, 0, 0.46)], 4)
        mesh = mesh.merged(tube(path, [0.013] * len(path), 10).rotated(2, turn))
    return mesh


def bottle():
    body = spline([(0.09, 0.0), (0.15, 0.05), (0.17, 0.16), (0.10, 0.27), (0.032, 0.34), (0.028, 0.52), (0.045, 0.56)], 4)
    return revolve([[(0.0, 0.0), body[0]], body, [body[-1], (0.036, 0.557), (0.02, 0.52), (0.0, 0.51)]], 40)


def dish():
    outer = spline([(0.08, 0.0), (0.075, 0.03), (0.18, 0.10), (0.27, 0.20)], 4)
    inner = spline([(0.262, 0.203), (0.17, 0.115), (0.06, 0.055), (0.0, 0.045)], 4)
    return revolve([[(0.0, 0.0), outer[0]], outer, [outer[-1], inner[0]], inner], 48)


def knot(p=2, q=3, steps=180):
    """A torus knot of round wire that stands on its plinth."""
    path = []
    for k in range(steps + 1):
        t = 2 * math.pi * k / steps
        r = 0.17 + 0.075 * math.cos(q * t)
        path.append((r * math.cos(p * t), 0.09 * math.sin(q * t), 0.285 + r * math.sin(p * t)))
    return tube(path, [0.042] * len(path), 14)


def egg():
    body = spline([(0.0, 0.0), (0.09, 0.02), (0.17, 0.14), (0.175, 0.26), (0.12, 0.42), (0.05, 0.50), (0.0, 0.51)], 5)
    return revolve([body], 48)


def shell():
    """A horn that winds up and narrows."""
    path, radii = [], []
    for k in range(121):
        s = k / 120
        t, r = 5.2 * math.pi * s, 0.17 * (1 - s) ** 1.2
        path.append((r * math.cos(t), r * math.sin(t), 0.10 + 0.40 * s**0.8))
        radii.append(0.012 + 0.088 * (1 - s) ** 1.25)
    return tube(path, radii, 18)


# Pictures on the walls; colours are as stored (sRGB).


def hills(u, v):
    sky = mix((0.93, 0.72, 0.48), (0.30, 0.44, 0.62), min(1, v * 1.4))
    for k, colour in enumerate(((0.42, 0.46, 0.60), (0.28, 0.36, 0.44), (0.16, 0.25, 0.26), (0.09, 0.14, 0.13))):
        line = 0.55 - 0.13 * k + 0.10 * math.sin(5 * u + 2.4 * k) + 0.06 * noise(7 * u, k, 64, 64, 3)
        if v < line:
            sky = colour
    return sky if math.hypot(u - 0.68, v - 0.74) > 0.085 else (0.98, 0.90, 0.68)


def rings(u, v):
    colour = (0.90, 0.86, 0.78)
    for cx, cy, size, paint in (
        (0.34, 0.60, 0.30, (0.76, 0.22, 0.14)),
        (0.66, 0.40, 0.36, (0.12, 0.26, 0.44)),
        (0.60, 0.78, 0.16, (0.90, 0.66, 0.16)),
    ):
        r = math.hypot(u - cx, 1.25 * (v - cy)) / size
        if r < 1 and int(r * 5) % 2 == 0:
            colour = mix(colour, paint, 0.88)
    return colour


def fields(u, v):
    if min(u, v, 1 - u, 1 - v) < 0.07:
        return (0.24, 0.09, 0.07)
    edge = 0.56 + 0.02 * noise(u * 9, 1, 64, 64, 8)
    base = (0.72, 0.24, 0.10) if v > edge else (0.88, 0.58, 0.20)
    return mix(base, (0.36, 0.10, 0.08), 0.5 * noise(u * 8, v * 8, 64, 64, 5))


def waves(u, v):
    s = 0.5 + 0.5 * math.sin(40 * (v + 0.05 * math.sin(9 * u + 6 * v) + 0.10 * noise(4 * u, 4 * v, 64, 64, 2)))
    return mix((0.06, 0.16, 0.28), mix((0.36, 0.62, 0.68), (0.92, 0.94, 0.88), v), round(6 * s) / 6)


def leaves(u, v):
    colour = (0.86, 0.84, 0.72)
    for k in range(26):
        cx, cy, turn = hash01(k, 1), hash01(k, 2), 6.3 * hash01(k, 3)
        x, y = (u - cx) * math.cos(turn) + (v - cy) * math.sin(turn), (v - cy) * math.cos(turn) - (u - cx) * math.sin(turn)
        if abs(x) < 0.16 and abs(y) < 0.055 * (1 - (x / 0.16) ** 2):
            colour = mix((0.10, 0.25, 0.16), (0.55, 0.60, 0.24), hash01(k, 4)) if abs(y) > 0.004 else (0.80, 0.78, 0.60)
    return colour


def night(u, v):
    colour = mix((0.05, 0.07, 0.16), (0.16, 0.16, 0.34), 1 - v)
    for k in range(60):
        if math.hypot(u - hash01(k, 11), v - 0.35 - 0.65 * hash01(k, 12)) < 0.004 + 0.006 * hash01(k, 13):
            colour = (0.95, 0.92, 0.80)
    house = int(u * 7)
    if v < 0.16 + 0.20 * hash01(house, 21):
        lit = hash01(int(u * 42), int(v * 42), 5) > 0.72 and (u * 42) % 1 > 0.3 and (v * 42) % 1 > 0.3
        colour = (0.96, 0.76, 0.32) if lit else (0.03, 0.04, 0.06)
    return colour


PICTURES = (hills, rings, fields, waves, leaves, night)
EXHIBITS = ((amphora, "terracotta"), (knot, "bronze"), (bottle, "celadon"), (egg, "marble"), (dish, "gilt"), (shell, "porcelain"))


# Scene files


class SceneFile:
    """Shapes as XML, a line each for their parts."""

    def __init__(self, title):
        self.lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<!-- {title} Written by make.py. -->", '<scene version="3.0.0">']

    def shape(self, kind, name, transform, *, bsdf=None, model=None, extra=()):
        self.lines.append(f'\t<shape type="{kind}" id="{name}">')
        if model:
            self.lines.append(f'\t\t<string name="filename" value="models/{model}.ply" />')
        self.lines += [f"\t\t{line}" for line in extra]
        if transform:
            self.lines += ['\t\t<transform name="to_world">', *(f"\t\t\t{step}" for step in transform), "\t\t</transform>"]
        if bsdf:
            self.lines.append(f'\t\t<ref id="{bsdf}" />')
        self.lines.append("\t</shape>")

    def write(self, path):
        path.write_text("\n".join([*self.lines, "</scene>"]) + "\n", encoding="utf-8")


def scale(x, y, z=1.0):
    return f'<scale x="{x:.4g}" y="{y:.4g}" z="{z:.4g}" />'


def rotate(axis, angle):
    return f'<rotate {axis}="1" angle="{angle:.5g}" />'


def translate(x, y, z):
    return f'<translate x="{x:.4g}" y="{y:.4g}" z="{z:.4g}" />'


def plinths(bay):
    """Where the bay's two exhibits stand."""
    side, row = bay
    x, y = middle(bay)
    return [(x - 1.55 * side, y + 0.35 - 0.5 * hash01(row, side + 2, 1)), (x + 0.9 * side, y - 0.5 + 0.5 * hash01(row, side + 2, 2))]


def paintings(bay):
    """Middle, and the angle about z that turns a picture which faces -y: one on the outer wall, one on the wall at the bay's far end."""
    side, row = bay
    x, y = middle(bay)
    return [(7.96 * side, y, -90 if side > 0 else 90), (x - 0.3 * side, y + DEPTH / 2 - 0.10, 0)]


def hall():
    """Walls between the bays, plinths, exhibits, pictures."""
    scene = SceneFile("Walls between the bays, plinths, exhibits and pictures.")
    for side in (-1, 1):
        for row in range(1, 6):
            scene.shape("cube", f"wall_{'lr'[side > 0]}{row}", [scale(2.85, 0.06, 1.75), translate(5.15 * side, DEPTH * row, 1.75)], bsdf="wall")
        for row in range(6):
            scene.shape("cube", f"screen_{'lr'[side > 0]}{row}", [scale(0.06, 0.36, 1.75), translate(2.36 * side, DEPTH * row + 3.64, 1.75)],
                        bsdf="screen")  # fmt: skip
    for k, bay in enumerate(BAYS):
        name = f"{'lr'[bay[0] > 0]}{bay[1]}"
        for i, (x, y) in enumerate(plinths(bay)):
            model, bsdf = EXHIBITS[(2 * k + i + k // 3) % len(EXHIBITS)]
            scene.shape("cube", f"plinth_{name}_{i}", [scale(0.24, 0.24, 0.5), translate(x, y, 0.5)], bsdf="plinth")
            scene.shape("ply", f"exhibit_{name}_{i}", [rotate("z", 360 * hash01(k, i, 3)), translate(x, y, 1.0)], bsdf=bsdf,
                        model=model.__name__)  # fmt: skip
        for i, (x, y, turn) in enumerate(paintings(bay)):
            place = [rotate("z", turn), translate(x, y, 1.65)]
            scene.shape("ply", f"frame_{name}_{i}", place, bsdf="gilt" if (k + i) % 3 else "dark_wood", model="frame")
            scene.shape("rectangle", f"picture_{name}_{i}", [scale(0.60, 0.45), rotate("x", 90), "<translate y=\"-0.035\" />", *place],
                        bsdf=f"picture_{PICTURES[(k + 3 * i) % len(PICTURES)].__name__}")  # fmt: skip
    return scene


def lights():
    """Kind, size (half width and height, or radius), transform after scaling, radiance, power of each light in the hall."""
    result = []

    def add(kind, width, height, place, colour, radiance):
        area = {"rectangle": 4 * width * height, "disk": math.pi * width * height, "sphere": 4 * math.pi * width * height}[kind]
        power = math.pi * area * radiance * (0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2])
        result.append((kind, width, height, place, tuple(radiance * c for c in colour), power))

    warm, white, cool = (1.0, 0.76, 0.48), (1.0, 0.90, 0.76), (0.78, 0.89, 1.0)
    down = rotate("x", 180)
    for k in range(6):  # globes over the aisle
        add("sphere", 0.09, 0.09, [translate(0, 2 + 4 * k, 3.1)], warm, 42 if k % 3 else 12)
    for k, bay in enumerate(BAYS):
        x, y = middle(bay)
        strength = 0.4 * 16 ** hash01(k, 5)  # some bays are bright, some nearly dark
        colour = (warm, white, cool)[int(3 * hash01(k, 6))]
        add("rectangle", 0.55, 0.16, [down, translate(x, y, 3.3)], colour, 7 * strength)
        for i, (px, py) in enumerate([*plinths(bay), (x, y)]):  # spots in cans: one over each exhibit, one over the floor
            radius = 0.035 + 0.035 * hash01(k, i, 7)
            add("disk", radius, radius, [down, translate(px, py, 3.1)], (warm, white)[(k + i) % 2], (1300, 900, 300)[i] * (0.3 + strength))
        for i, (px, py, turn) in enumerate(paintings(bay)):  # a thin strip above each picture, leaning back to it
            add("rectangle", 0.30, 0.012, [rotate("x", -150), translate(0, -0.24, 2.32), rotate("z", turn), translate(px, py, 0)], warm,
                150 * (0.25 + hash01(k, i, 8)))  # fmt: skip
        add("sphere", 0.02, 0.02, [translate(x + 2.4 * bay[0], y - 1.7, 0.12)], cool, 30 * hash01(k, 9))  # a small one on the floor
    for x, y, turn in ((0, 23.97, 0), (-7.97, 0.6, 90), (7.97, 0.6, -90)):  # signs over the doors
        add("rectangle", 0.22, 0.09, [rotate("x", 90), rotate("z", turn), translate(x, y, 2.5)], (0.15, 1.0, 0.35), 2.5)
    assert len(result) == LIGHTS, len(result)
    return result


def light_file(by_power):
    scene = SceneFile("93 lights, " + ("each chosen in proportion to its power." if by_power else "each chosen as often as any other."))
    mean = sum(light[-1] for light in lights()) / LIGHTS
    for k, (kind, width, height, place, radiance, power) in enumerate(lights()):
        weight = [f'\t<float name="sampling_weight" value="{power / mean:.5g}" />'] if by_power else []
        emitter = ['<emitter type="area">', *weight, f'\t<rgb name="radiance" value="{", ".join(f"{c:.5g}" for c in radiance)}" />', "</emitter>"]
        sized = [scale(width, height, width if kind == "sphere" else 1.0), *place]
        scene.shape(kind, f"light_{k}", sized, extra=emitter)
        if kind == "disk":  # the can that it shines from
            scene.shape("cylinder", f"can_{k}", [scale(1.25 * width, 1.25 * width, 0.28), "<translate z=\"-0.02\" />", *place], bsdf="can")
    return scene


def main():
    models, textures = HERE / "models", HERE / "textures"
    models.mkdir(exist_ok=True)
    textures.mkdir(exist_ok=True)
    for model, _ in EXHIBITS:
        write_ply(models / f"{model.__name__}.ply", model())
    write_ply(models / "frame.ply", rounded_box((1.34, 0.06, 1.04), 0.015))
    for picture in PICTURES:
        write_png(textures / f"{picture.__name__}.png", 160, 120, lambda x, y, p=picture: p((x + 0.5) / 160, 1 - (y + 0.5) / 120))
    hall().write(HERE / "hall.xml")
    light_file(False).write(HERE / "lights-even.xml")
    light_file(True).write(HERE / "lights-power.xml")


if __name__ == "__main__":
    main()
