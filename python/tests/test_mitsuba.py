"""Against Mitsuba's own rendering of its Cornell box, 16 x 16 pixels, one path at a time."""
import os
import subprocess
import sys

import numpy as np
import pytest

mi = pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed")
mi.set_variant("scalar_rgb")
import warpath  # noqa: E402
import warpath.mitsuba  # noqa: E402
from warpath.mitsuba.numbers import Order  # noqa: E402

RUNS, SPP = 24, 8


def box(integrator="path", sensor="perspective", **of_sensor):
    scene = mi.cornell_box()
    scene["sensor"] |= {"type": sensor, "film": scene["sensor"]["film"] | {"width": 16, "height": 16}, **of_sensor}
    scene["integrator"] = {"type": integrator} | ({} if integrator == "direct" else {"max_depth": 4})
    return mi.load_dict(scene)


def images(render):
    return np.stack([np.array(render(seed), float) for seed in range(RUNS)])


def agree(ours, theirs):
    """t-tests with 46 degrees of freedom of the image's mean (above 5 by chance in 1e5), and of 4 x 4 pixels each, whose squares have a
    mean above 3 by chance in 2e4 (16 independent ones at least, as channels are not)."""
    def t(a, b):
        return (a.mean(0) - b.mean(0)) / np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / RUNS)

    def bins(x):
        return x.reshape(RUNS, 4, 4, 4, 4, 3).mean((2, 4))

    assert np.abs(t(ours.mean((1, 2)), theirs.mean((1, 2)))).max() < 5
    assert (t(bins(ours), bins(theirs)) ** 2).mean() < 3


@pytest.mark.parametrize(
    "integrator, warp",
    [
        ("path", "none"),
        ("path", "kdtree:film+bounce1"),
        ("path", "kdtree:bounce1.light_uv+bounce1.lobe+bounce1"),
        ("direct", "grid:film+bounce1.light_uv"),
        ("volpath", "kdtree:film+bounce1"),
    ],
)
def test_the_expectation_is_that_of_mitsuba(integrator, warp):
    scene = box(integrator)
    trained = warp if warp == "none" else warpath.mitsuba.train(scene, warp, epp=0.02)
    ours = images(lambda seed: warpath.mitsuba.render(scene, SPP, trained, seed=seed))
    agree(ours, images(lambda seed: mi.render(scene, spp=SPP, seed=1000 + seed)))


def test_lens_and_time_can_be_warped():
    scene = box(sensor="thinlens", aperture_radius=0.1, focus_distance=4.0, shutter_open=0.0, shutter_close=1.0)
    trained = warpath.mitsuba.train(scene, "kdtree:film+lens+time", epp=0.02)
    ours = images(lambda seed: warpath.mitsuba.render(scene, SPP, trained, seed=seed))
    agree(ours, images(lambda seed: mi.render(scene, spp=SPP, seed=1000 + seed)))


def columns(order, questions):
    """The column that answers each question, or None."""
    state, found = order.first, []
    for size in questions:
        found.append(next((answer.column for answer in order.answers[size] if answer.state == state), None))
        state = order.after(state, size)
    return found


@pytest.mark.parametrize(
    "integrator, names, questions, expected",
    [
        # light, lobe, direction, roulette
        ("path", "film+bounce1+bounce2.light_uv", [2, 1, 2, 1, 2, 1, 2, 1], [None, None, 2, None, 4, None, None, None]),
        ("path", "bounce2.lobe+bounce1.rr", [2, 1, 2, 1, 2, 1, 2, 1], [None, None, None, 0, None, 1, None, None]),
        # A mirror first: its scalar path asks for no light.
        ("path", "bounce1+bounce2.light_uv", [1, 2, 1, 2, 1], [None, 0, None, 2, None]),
        ("direct", "bounce1.lobe+bounce1", [2, 2, 1], [None, 1, 0]),
        # A colour channel, then roulette, light, direction, lobe
        ("volpath", "bounce1.lobe+bounce1+bounce2.light_uv", [1, 1, 2, 2, 1, 1, 2, 2, 1], [None, None, None, 1, 0, None, 3, None, None]),
    ],
)
def test_named_numbers_answer_the_questions_that_they_are_for(integrator, names, questions, expected):
    assert columns(Order(mi.load_dict({"type": integrator}), warpath.Layout(names)), questions) == expected


def test_a_trained_warp_serves_as_object_and_as_file(tmp_path):
    scene = box()
    trained = warpath.mitsuba.train(scene, "kdtree:film+bounce1", epp=0.01)
    trained.save(tmp_path / "box.warp")
    by_object, by_file = (np.array(warpath.mitsuba.render(scene, 2, warp)) for warp in (trained, tmp_path / "box.warp"))
    assert by_object.shape == (16, 16, 3) and np.array_equal(by_object, by_file)
    assert not np.array_equal(by_object, np.array(warpath.mitsuba.render(scene, 2, trained, seed=1)))


def test_as_a_plugin():
    scene = box()
    plugin = mi.load_dict({"type": "warpath", "warp": "kdtree:film+bounce1", "epp": 0.01, "nested": {"type": "path", "max_depth": 4}})
    direct = warpath.mitsuba.render(scene, 2, "kdtree:film+bounce1", epp=0.01, seed=7)
    assert np.array_equal(np.array(mi.render(scene, integrator=plugin, spp=2, seed=7)), np.array(direct))


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: warpath.mitsuba.render(box(), 1, "kdtree:bounce1.light"), "bounce1.light_uv means both"),
        (lambda: warpath.mitsuba.render(box(), 1, "kdtree", epq=1), 'unknown option "epq"; did you mean "epp"?'),
        (lambda: warpath.mitsuba.render(box(), 1, "kdtree", couplings=3), "couplings: kdtree does not use it; it is for realnvp"),
        (lambda: warpath.mitsuba.render(box(), 1, "kdtee"), 'unknown warp "kdtee"'),
        (lambda: warpath.mitsuba.render(box("direct"), 1, "kdtree:bounce2"), "one bounce"),
        (lambda: warpath.mitsuba.train(box(), "uniform:film"), "nothing to train"),
        (lambda: warpath.mitsuba.render(box(), 1, "none", integrator=mi.load_dict({"type": "depth"})), "known: path, direct and volpath"),
    ],
)
def test_bad_usage_is_a_clear_error(call, text):
    with pytest.raises(ValueError) as error:
        call()
    assert text in str(error.value)


LLVM = """
import numpy as np
import test_mitsuba as t
t.mi.set_variant("llvm_ad_rgb")
scene = t.box()
for warp in ("none", "kdtree:film+bounce1"):
    t.agree(t.images(lambda seed: t.warpath.mitsuba.render(scene, t.SPP, warp, seed=seed, epp=0.1)),
            t.images(lambda seed: t.mi.render(scene, spp=t.SPP, seed=1000 + seed)))
"""


@pytest.mark.skipif(
    "DRJIT_LIBLLVM_PATH" not in os.environ,
    reason="DRJIT_LIBLLVM_PATH is not set; LLVM before 19 ends the process on CPUs with AVX-512",
)
def test_in_wavefronts():
    subprocess.run([sys.executable, "-c", LLVM], check=True, cwd=os.path.dirname(__file__))
