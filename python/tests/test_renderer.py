import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import warpath


def test_without_the_renderer_the_error_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "warpath._renderer", None)
    monkeypatch.delattr(warpath, "_renderer", raising=False)
    with pytest.raises(ImportError, match="packages.txt") as error:
        warpath.load_scene("scene.xml")
    assert "\n" not in str(error.value)


pytest.importorskip("warpath._renderer", reason="the renderer is not built in")
SOURCE = pathlib.Path(os.environ.get("WARPATH_SOURCE", pathlib.Path(__file__).parents[2]))
BOX = SOURCE / "scenes" / "box" / "scene.xml"


@pytest.fixture(scope="module")
def box():
    return warpath.load_scene(BOX, size=(48, 32), max_depth=4)


@pytest.mark.parametrize("warp", ["uniform:film", "kdtree:film+bounce1", "grid:bounce1.light_uv+bounce1", "field", "auto"])
def test_every_method_has_the_expectation_of_path_tracing(box, warp):
    """Means of 16 x 16 pixels in units of their own errors: none of 18 beyond 5.5 (by chance in 1e6)."""
    training = {"epp": 0.5} if warp.startswith(("kdtree", "grid")) else {}
    plain = warpath.render(box, spp=256, seed=7)
    warped = warpath.render(box, spp=64, warp=warp, seed=3 + len(warp), **training)

    def bins(x):
        return x.reshape(2, 16, 3, 16, 3).mean((1, 3))

    difference = bins(np.asarray(plain, float)) - bins(np.asarray(warped, float))
    error = np.sqrt((bins(plain.variance.astype(float)) + bins(warped.variance.astype(float))) / 256)
    # The filter spreads samples over neighbours, whose errors are then alike.
    assert np.abs(difference / error).max() < 5.5 * 1.8


def test_an_image_knows_how_it_was_made(box):
    image = warpath.render(box, spp=4)
    assert image.shape == image.variance.shape == (32, 48, 3) and image.dtype == np.float32
    assert image.samples.shape == (32, 48) and np.all(image.samples == 4) and image.spp == 4
    assert image.seconds > 0 and image.non_finite == 0
    assert (box.width, box.height, box.max_depth) == (48, 32, 4) and box.emitters >= 1


def test_the_scene_says_how_many_samples_unless_the_caller_does():
    scene = warpath.load_scene(BOX, size=(8, 8), max_depth=2, spp=3)
    assert warpath.render(scene).spp == warpath.render(scene, spp=None).spp == scene.spp == 3
    assert warpath.render(scene, spp=2).spp == 2


def test_same_seed_same_bits(box):
    first, again, other = (warpath.render(box, spp=2, warp="kdtree:film+bounce1", epp=0.1, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_the_same_bits_as_the_command_line(box, tmp_path):
    mi = pytest.importorskip("mitsuba", reason="Mitsuba 3, which reads the image, is not installed")
    binary = os.environ.get("WARPATH_BINARY")
    if not binary:
        pytest.skip("WARPATH_BINARY does not name the command line's binary")
    mi.set_variant("scalar_rgb")
    file = tmp_path / "box.exr"
    subprocess.run([binary, "render", BOX, "--size", "48x32", "--max-depth", "4", "--spp", "4", "--warp", "kdtree:film+bounce1", "--epp", "0.1",
                    "--seed", "5", "--quiet", "-o", file], check=True)
    pixels = np.array(dict(mi.Bitmap(str(file)).split())["<root>"], np.float32)[:, :, :3]
    assert np.array_equal(pixels, warpath.render(box, spp=4, warp="kdtree:film+bounce1", epp=0.1, seed=5))


def test_parameters_and_crop_of_the_scene():
    scene = warpath.load_scene(BOX, size=(48, 32), crop=(8, 4, 16, 12))
    assert warpath.render(scene, spp=1).shape == (12, 16, 3)
    with pytest.raises(ValueError, match="no parameter"):
        warpath.load_scene(BOX, nonsense=1)


@pytest.mark.parametrize(
    "call, error, text",
    [
        (lambda box: warpath.render(box, warp="knn"), ValueError, 'unknown warp "knn"'),
        (lambda box: warpath.render(box, sampler="halton"), ValueError, 'sampler: unknown value "halton"; known: independent'),
        (lambda box: warpath.render(box, objective="psnr"), ValueError, 'objective: unknown value "psnr"; known: mse, relmse'),
        (lambda box: warpath.render(box, sampler="sobol", warp="uniform:film"), ValueError, "its samples are independent"),
        (lambda box: warpath.render(box, epq=1), ValueError, 'unknown option "epq"; did you mean "epp"?'),
        (lambda box: warpath.render(box, spp=0), ValueError, 'spp: "0" is not a whole number, 1 to'),
        (lambda box: warpath.render(box, time=float("inf")), ValueError, "time: "),
        (lambda box: warpath.render(box, seed=-1), ValueError, 'seed: "-1" is not a whole number'),
        (lambda box: warpath.render(box, warp="field", couplings=3), ValueError, "couplings: field does not use it; it is for realnvp"),
        (lambda box: warpath.render(box, warp="kdtree", uniform=0.1), ValueError, "uniform is now called uniform_share"),
        (lambda box: warpath.load_scene("none.xml"), OSError, "none.xml"),
        (lambda box: warpath.load_scene(BOX, crop=(0, 0, 9999, 1)), ValueError, "not inside the film"),
    ],
)
def test_bad_usage_is_a_clear_error(box, call, error, text):
    with pytest.raises(error) as raised:
        call(box)
    assert text in str(raised.value)
