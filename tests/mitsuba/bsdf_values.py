#!/usr/bin/env python3
"""Writes tests/data/bsdf_values.json: what Mitsuba 3 gives for every BSDF and texture that warpath supports.

Run by hand where Mitsuba is installed; src/tracer/bsdf_mitsuba_test.cpp compares warpath with the file. Each case is a
scene file with one BSDF, so the test covers the loader too. Directions are local: the surface is the xy plane with
dp_du = x, dp_dv = y.

    python3 tests/mitsuba/bsdf_values.py
"""

import json
import pathlib
import struct
import zlib

import mitsuba as mi

mi.set_variant("scalar_rgb")

DATA = pathlib.Path(__file__).resolve().parent.parent / "data"
WI = [(0.3, -0.2, 0.9327379), (-0.85, 0.4, 0.3427827), (0.4, 0.5, -0.7681146)]
SAMPLES = [(0.05, 0.3, 0.6), (0.55, 0.81, 0.27), (0.93, 0.1, 0.9)]
UV = [(0.31, 0.67), (0.02, 0.99), (-0.4, 1.7)]


def normalized(v):
    n = sum(x * x for x in v) ** 0.5
    return tuple(x / n for x in v)


def wo_for(wi):
    """Near the mirror and the refracted direction, where glossy lobes are, and far from both."""
    s = 1 if wi[2] > 0 else -1
    return [
        normalized((-wi[0] + 0.03, -wi[1] - 0.05, wi[2])),
        normalized((-wi[0] - 0.2, -wi[1] + 0.3, wi[2] * 0.8)),
        normalized((-wi[0] / 1.5 + 0.02, -wi[1] / 1.5 + 0.03, -0.75 * s)),
        normalized((-wi[0] * 1.5 + 0.02, -wi[1] * 1.5 + 0.03, -0.3 * s)),
        normalized((0.5, 0.6, 0.7)),
        normalized((0.2, -0.7, -0.9)),
    ]


def png(path, width, height, channels, values):
    """An 8-bit PNG without any colour chunk."""
    rows = b"".join(b"\0" + bytes(values[y * width * channels : (y + 1) * width * channels]) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 0, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    )


def pattern(count, scale=255):
    return [(i * 97 + (i * i * 31) % 101) % (scale + 1) for i in range(count)]


def rgb(name, value):
    return f'<rgb name="{name}" value="{value}"/>'


def num(name, value):
    return f'<float name="{name}" value="{value}"/>'


def flag(name, value):
    return f'<boolean name="{name}" value="{"true" if value else "false"}"/>'


def text(name, value):
    return f'<string name="{name}" value="{value}"/>'


def bsdf(kind, *inner):
    return f'<bsdf type="{kind}">{"".join(inner)}</bsdf>'


def texture(name, kind, *inner):
    attribute = f' name="{name}"' if name else ""
    return f'<texture{attribute} type="{kind}">{"".join(inner)}</texture>'


def bitmap(name, *inner, file="pattern_rgb.png"):
    return texture(name, "bitmap", text("filename", file), *inner)


TO_UV = '<transform name="to_uv"><scale x="2.5" y="1.5"/><translate x="0.3" y="-0.2"/></transform>'
TURNED = '<transform name="to_uv"><rotate z="1" angle="30"/><scale x="3" y="2"/></transform>'
DIFFUSE = bsdf("diffuse", rgb("reflectance", "0.7 0.4 0.2"))
GOLD = bsdf("roughconductor", text("material", "Au"), text("distribution", "ggx"), num("alpha", 0.2))
ANISOTROPIC = bsdf(
    "roughconductor", text("distribution", "ggx"), num("alpha_u", 0.1), num("alpha_v", 0.35),
    rgb("specular_reflectance", "0.9 0.8 0.7"),
)
PLASTIC = bsdf("roughplastic", rgb("diffuse_reflectance", "0.1 0.3 0.6"), num("alpha", 0.15))


def cases():
    yield from lobe_cases()
    yield from principled_cases()
    yield from nesting_cases()
    yield from map_cases()
    yield from texture_cases()


def lobe_cases():
    yield "diffuse", DIFFUSE
    yield "conductor none", bsdf("conductor")
    yield "conductor Cu", bsdf("conductor", text("material", "Cu"), rgb("specular_reflectance", "0.9 0.8 0.7"))
    yield "conductor eta k", bsdf("conductor", rgb("eta", "0.2 0.9 1.4"), rgb("k", "3.9 2.4 1.7"))
    for distribution in ("ggx", "beckmann"):
        for visible in (True, False):
            common = (text("distribution", distribution), flag("sample_visible", visible))
            label = f"{distribution} {'visible' if visible else 'all'}"
            yield f"roughconductor {label}", bsdf("roughconductor", text("material", "Al"), num("alpha", 0.15), *common)
            yield f"roughconductor anisotropic {label}", bsdf(
                "roughconductor", num("alpha_u", 0.08), num("alpha_v", 0.4), text("material", "Ag"), *common
            )
            yield f"roughdielectric {label}", bsdf("roughdielectric", num("alpha", 0.25), *common)
            yield f"roughdielectric anisotropic {label}", bsdf(
                "roughdielectric", num("alpha_u", 0.5), num("alpha_v", 0.15), num("int_ior", 1.33), *common
            )
            yield f"roughplastic {label}", bsdf("roughplastic", num("alpha", 0.2), *common)
    yield "roughconductor smooth", bsdf("roughconductor", text("distribution", "ggx"), num("alpha", 0.01))
    yield "roughconductor textured", bsdf("roughconductor", text("distribution", "ggx"), bitmap("alpha", flag("raw", True)))
    yield "dielectric", bsdf("dielectric", text("int_ior", "diamond"), rgb("specular_transmittance", "0.9 0.5 0.4"))
    yield "dielectric inverted", bsdf("dielectric", num("int_ior", 1.0), num("ext_ior", 1.5))
    yield "thindielectric", bsdf("thindielectric", rgb("specular_reflectance", "0.9 0.5 0.4"))
    yield "roughdielectric tinted", bsdf(
        "roughdielectric", num("alpha", 0.1), num("int_ior", 1.7), rgb("specular_reflectance", "0.9 0.5 0.4"),
        rgb("specular_transmittance", "0.3 0.6 0.8"),
    )
    yield "roughdielectric inverted", bsdf("roughdielectric", num("alpha", 0.3), num("int_ior", 1.0), num("ext_ior", 1.5))
    yield "plastic", bsdf("plastic", rgb("diffuse_reflectance", "0.1 0.3 0.6"))
    yield "plastic nonlinear", bsdf(
        "plastic", rgb("diffuse_reflectance", "0.1 0.3 0.9"), flag("nonlinear", True), num("int_ior", 1.9),
        rgb("specular_reflectance", "0.5 0.6 0.7"),
    )
    yield "plastic textured", bsdf("plastic", bitmap("diffuse_reflectance"))
    yield "roughplastic nonlinear", bsdf(
        "roughplastic", rgb("diffuse_reflectance", "0.1 0.3 0.9"), flag("nonlinear", True), num("alpha", 0.05),
        text("distribution", "ggx"), num("int_ior", 1.9), rgb("specular_reflectance", "0.5 0.6 0.7"),
    )
    yield "roughplastic rough", bsdf("roughplastic", num("alpha", 0.6), text("distribution", "ggx"))


def principled_cases():
    base = rgb("base_color", "0.8 0.3 0.1")
    yield "principled", bsdf("principled", base)
    yield "principled metallic", bsdf("principled", base, num("metallic", 0.7), num("roughness", 0.3))
    yield "principled anisotropic", bsdf(
        "principled", base, num("anisotropic", 0.8), num("metallic", 1.0), num("roughness", 0.4)
    )
    yield "principled coated", bsdf(
        "principled", base, num("clearcoat", 0.9), num("clearcoat_gloss", 0.3), num("specular", 0.7), num("spec_tint", 0.6)
    )
    yield "principled cloth", bsdf(
        "principled", base, num("sheen", 0.9), num("sheen_tint", 0.5), num("flatness", 0.6), num("roughness", 0.8)
    )
    yield "principled glass", bsdf("principled", base, num("spec_trans", 0.8), num("eta", 1.4), num("roughness", 0.4))
    yield "principled all", bsdf(
        "principled", base, num("spec_trans", 0.4), num("metallic", 0.3), num("clearcoat", 0.5), num("sheen", 0.4),
        num("sheen_tint", 0.3), num("flatness", 0.2), num("spec_tint", 0.7), num("anisotropic", 0.5),
        num("clearcoat_gloss", 0.8), num("diffuse_reflectance_sampling_rate", 0.7),
        num("main_specular_sampling_rate", 1.4), num("clearcoat_sampling_rate", 2.0),
    )
    yield "principled textured", bsdf("principled", bitmap("base_color"), bitmap("roughness", file="pattern_grey.png"))


def nesting_cases():
    yield "twosided", bsdf("twosided", DIFFUSE)
    yield "twosided plastic", bsdf("twosided", PLASTIC)
    yield "twosided anisotropic", bsdf("twosided", ANISOTROPIC)
    yield "twosided pair", bsdf("twosided", DIFFUSE, GOLD)
    yield "mask", bsdf("mask", num("opacity", 0.3), DIFFUSE)
    yield "mask textured", bsdf("mask", bitmap("opacity", flag("raw", True), file="pattern_grey.png"), PLASTIC)
    yield "mask twosided", bsdf("mask", num("opacity", 0.6), bsdf("twosided", GOLD))
    yield "blend", bsdf("blendbsdf", num("weight", 0.4), DIFFUSE, GOLD)
    yield "blend of blends", bsdf(
        "blendbsdf", num("weight", 0.3), bsdf("blendbsdf", num("weight", 0.6), PLASTIC, DIFFUSE),
        bsdf("mask", num("opacity", 0.7), ANISOTROPIC),
    )
    yield "blend checkerboard", bsdf("blendbsdf", texture("weight", "checkerboard", TO_UV), DIFFUSE, GOLD)
    yield "null", bsdf("null")


def map_cases():
    bumps = bitmap("", flag("raw", True), file="pattern_grey.png")
    normals = bitmap("normalmap", flag("raw", True), file="normals.png")
    yield "bumpmap", bsdf("bumpmap", bumps, num("scale", 0.02), DIFFUSE)
    yield "bumpmap plain", bsdf(
        "bumpmap", bitmap("", flag("raw", True), TURNED, file="pattern_square.png"), num("scale", 0.1),
        flag("use_shadowing_function", False), flag("flip_invalid_normals", False), GOLD,
    )
    yield "bumpmap twosided", bsdf("twosided", bsdf("bumpmap", bumps, num("scale", 0.02), PLASTIC))
    yield "normalmap", bsdf("normalmap", normals, DIFFUSE)
    yield "normalmap anisotropic", bsdf("normalmap", normals, ANISOTROPIC)
    yield "normalmap twosided", bsdf("twosided", bsdf("normalmap", normals, ANISOTROPIC))
    yield "normalmap of twosided", bsdf("normalmap", normals, bsdf("twosided", DIFFUSE))
    yield "normalmap glass", bsdf("normalmap", normals, bsdf("roughdielectric", num("alpha", 0.3)))
    yield "normalmap plain", bsdf(
        "normalmap", normals, flag("use_shadowing_function", False), flag("flip_invalid_normals", False), GOLD
    )


def texture_cases():
    for wrap in ("repeat", "mirror", "clamp"):
        for filter_type in ("nearest", "bilinear"):
            yield f"bitmap {wrap} {filter_type}", bsdf(
                "diffuse", bitmap("reflectance", text("wrap_mode", wrap), text("filter_type", filter_type), TO_UV)
            )
    yield "bitmap turned", bsdf("diffuse", bitmap("reflectance", TURNED))
    yield "bitmap raw", bsdf("diffuse", bitmap("reflectance", flag("raw", True)))
    yield "bitmap grey", bsdf("diffuse", bitmap("reflectance", file="pattern_grey.png"))
    yield "checkerboard", bsdf(
        "diffuse", texture("reflectance", "checkerboard", rgb("color0", "0.1 0.2 0.3"), rgb("color1", "0.7 0.8 0.9"), TO_UV)
    )


def scene_xml(bsdf_xml):
    return f'<scene version="3.0.0"><sensor type="perspective"/><shape type="rectangle">{bsdf_xml}</shape></scene>'


def short(values):
    return [float(f"{float(v):.5g}") for v in values]


def interaction(wi, uv):
    si = mi.SurfaceInteraction3f()
    si.t = 1
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    si.dp_du = mi.Vector3f(1, 0, 0)
    si.dp_dv = mi.Vector3f(0, 1, 0)
    si.uv = mi.Point2f(*uv)
    si.wi = mi.Vector3f(*wi)
    return si


def measure(bsdf_xml):
    b = mi.load_string(scene_xml(bsdf_xml)).shapes()[0].bsdf()
    context = mi.BSDFContext()
    points = []
    for wi, uv in zip(WI, UV):
        si = interaction(wi, uv)
        evals, samples = [], []
        for wo in wo_for(wi):
            value, pdf = b.eval_pdf(context, si, mi.Vector3f(*wo))
            evals.append(short([*value, pdf]))
        for u, x, y in SAMPLES:
            s, weight = b.sample(context, si, u, mi.Point2f(x, y))
            delta = mi.has_flag(s.sampled_type, mi.BSDFFlags.Delta) or mi.has_flag(s.sampled_type, mi.BSDFFlags.Null)
            samples.append(short([*s.wo, *weight, s.pdf, s.eta, delta]))
        points.append({"eval": evals, "samples": samples})
    return points


def main():
    DATA.mkdir(exist_ok=True)
    png(DATA / "pattern_rgb.png", 5, 3, 3, pattern(45))
    png(DATA / "pattern_grey.png", 5, 3, 1, pattern(15))
    png(DATA / "pattern_square.png", 4, 4, 1, pattern(16))
    png(DATA / "normals.png", 3, 2, 3, [140, 110, 230, 100, 150, 220, 180, 128, 200, 20, 128, 160, 128, 128, 255, 90, 90, 240])
    mi.file_resolver().append(str(DATA))
    lines = []
    for name, xml in cases():
        case = {"name": name, "xml": scene_xml(xml), "points": measure(xml)}
        lines.append(json.dumps(case, separators=(",", ":")))
    header = {
        "made_by": "tests/mitsuba/bsdf_values.py",
        "mitsuba": mi.__version__,
        "wi": WI,
        "uv": UV,
        "wo": [[[round(x, 7) for x in wo] for wo in wo_for(wi)] for wi in WI],
        "lobe_dir": SAMPLES,
        "eval": "r g b pdf, per wo",
        "samples": "wo x y z, weight r g b, pdf, eta, delta, per lobe_dir",
    }
    body = json.dumps(header, separators=(",", ":"))[:-1] + ',"cases":[\n' + ",\n".join(lines) + "\n]}\n"
    (DATA / "bsdf_values.json").write_text(body)


if __name__ == "__main__":
    main()
