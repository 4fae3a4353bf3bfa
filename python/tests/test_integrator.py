import math
import pathlib
import warnings

import numpy as np
import pytest

import warpath

SIGMA = 0.2


def camel(x):
    """Two Gaussians, at 1/3 and 2/3 of the diagonal."""
    peaks = [np.exp(-((x - c) ** 2).sum(axis=1) / SIGMA**2) for c in (1 / 3, 2 / 3)]
    return 0.5 * sum(peaks) * (SIGMA * math.sqrt(math.pi)) ** -x.shape[1]


def camel_exact(dims):
    return (0.5 * (math.erf(2 / (3 * SIGMA)) + math.erf(1 / (3 * SIGMA)))) ** dims


def test_adapts_and_measures():
    integrator = warpath.Integrator([(0, 1)] * 4)
    integrator(camel, nitn=6, neval=20_000)
    result = integrator(camel, nitn=5, neval=20_000, adapt=False)
    assert abs(result.mean - camel_exact(4)) < 6 * result.sdev  # a false alarm in 5e8
    assert result.sdev * math.sqrt(result.sum_neval) / result.mean < 0.5  # 2.7 for uniform points
    assert integrator.warp == "grid+spline"
    assert result.dof == 4 and len(result.itn_results) == 5
    assert 0 <= result.Q <= 1
    assert 90_000 < result.sum_neval <= 100_000
    assert 0 < result.unweighting_efficiency <= 1
    assert result.effective_samples > 0.8 * result.itn_results[-1].neval


def test_values_over_hundreds_of_orders_of_magnitude_teach():
    """Most of the first points are in tails; weights that were scaled by one of those once saturated."""

    def ring(x):
        return np.exp(-400 * (np.hypot(x[:, 0], x[:, 1]) - 1) ** 2)

    integrator = warpath.Integrator([(-2, 2)] * 2, seed=1)
    integrator(ring, nitn=8, neval=10_000)
    result = integrator(ring, nitn=4, neval=10_000, adapt=False)
    assert abs(result.mean - 2 * math.pi * math.sqrt(math.pi / 400)) < 6 * result.sdev  # a false alarm in 5e8
    assert result.effective_samples > 0.7 * result.itn_results[-1].neval  # 0.03 for uniform points


@pytest.mark.filterwarnings("ignore:iterations differ")  # a few in a hundred do by chance
@pytest.mark.parametrize("warp, seeds", [("uniform", 10), ("grid", 10), ("kdtree", 10), ("realnvp", 3), ("spline", 3), ("grid+spline", 3)])
def test_every_family_integrates_without_bias(warp, seeds):
    """None of at most 10 pulls is above 5.5 (by chance in 2e6), and their squares sum to no more than chance gives in 1e5 (chi-squared)."""
    pulls = []
    for seed in range(seeds):
        integrator = warpath.Integrator([(0, 1)] * 3, warp=warp, seed=seed)
        integrator(camel, nitn=3, neval=4000)
        result = integrator(camel, nitn=4, neval=4000, adapt=False)
        pulls.append((result.mean - camel_exact(3)) / result.sdev)
    assert integrator.warp == warp
    assert np.abs(pulls).max() < 5.5 and np.sum(np.square(pulls)) < {10: 42, 3: 26}[seeds]
    spread = result.sdev * math.sqrt(result.sum_neval) / result.mean
    assert spread < (2.2 if warp == "uniform" else 1.6)


def test_same_seed_same_numbers():
    def run(seed):
        integrator = warpath.Integrator([(0, 1)] * 2, seed=seed)
        return integrator(camel, nitn=4, neval=5000).mean

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_several_integrals_at_once():
    integrator = warpath.Integrator([(0, 2), (-1, 3)])
    result = integrator(lambda x: np.stack([x[:, 0], x[:, 1], x[:, 0] * 0 + 1], axis=1), nitn=4, neval=4000)
    assert result.mean.shape == (3,) and result.cov.shape == (3, 3)
    assert np.all(np.abs(result.mean - [8, 8, 8]) <= 6 * result.sdev + 1e-9)
    assert np.allclose(np.diag(result.cov), result.sdev**2)
    assert str(result).startswith("[")
    matrix = integrator(lambda x: x[:, :, None] * [[[1.0, 2.0]]], nitn=2, neval=1000)
    assert matrix.mean.shape == (2, 2)


def test_integrands_made_for_vegas():
    def batch(x):
        return x[:, 0] ** 2

    def rbatch(x):
        assert x.shape[0] == 2
        return x[0] ** 2

    def scalar(x):
        return x[0] ** 2

    rbatch.fcntype, scalar.fcntype = "rbatch", "scalar"
    means = [warpath.Integrator([(0, 1)] * 2)(f, nitn=2, neval=500).mean for f in (batch, rbatch, scalar)]
    assert means[0] == pytest.approx(1 / 3, abs=1e-2)
    assert means[0] == means[1] == means[2]


def test_decorators_of_vegas():
    vegas = pytest.importorskip("vegas", reason="vegas is not installed")

    @vegas.batchintegrand
    def f(x):
        return np.asarray(x)[:, 0]

    @vegas.rbatchintegrand
    def g(x):
        return x[0]

    for integrand in (f, g):
        assert warpath.Integrator([(0, 1)] * 2)(integrand, nitn=2, neval=500).mean == pytest.approx(0.5, abs=1e-2)


def test_an_exception_brings_its_batch():
    def f(x):
        if np.any(x[:, 0] > 0.5):
            raise ArithmeticError("too far")
        return x[:, 0]

    integrator = warpath.Integrator([(0, 1)])
    with pytest.raises(ArithmeticError, match="too far") as error:
        integrator(f, nitn=1, neval=1000)
    assert error.value.batch.shape[1] == 1
    # and leaves an integrator that works
    assert integrator(lambda x: x[:, 0], nitn=1, neval=1000).mean == pytest.approx(0.5, abs=1e-2)


def test_values_that_are_not_finite_are_reported():
    integrator = warpath.Integrator([(0, 1)], warp="uniform")
    with pytest.warns(RuntimeWarning, match="not finite"):
        result = integrator(lambda x: np.where(x[:, 0] < 0.5, np.nan, 1.0), nitn=2, neval=1024)
    assert result.non_finite == 1024
    assert result.mean == pytest.approx(0.5)


def test_samples_follow_the_density():
    integrator = warpath.Integrator([(0, 2)] * 2)
    integrator(lambda x: camel(x / 2), nitn=5, neval=10_000)
    sample = integrator.sample(20_000)
    assert sample.x.shape == (20_000, 2) and np.allclose(sample.weight * sample.density, 1)
    assert np.all((sample.x >= 0) & (sample.x <= 2))
    f = camel(sample.x / 2) * sample.weight
    assert abs(f.mean() - 4 * camel_exact(2)) < 6 * f.std() / math.sqrt(len(f))
    assert np.allclose(integrator.density(sample.x), sample.density, rtol=0.05)


def test_saved_and_loaded(tmp_path):
    integrator = warpath.Integrator([(0, 1)] * 3)
    integrator(camel, nitn=6, neval=10_000)
    integrator.save(tmp_path / "camel.warp")
    loaded = warpath.Integrator.load(tmp_path / "camel.warp")
    assert loaded.warp == integrator.warp
    x = integrator.sample(100).x
    assert np.array_equal(loaded.density(x), integrator.density(x))
    with pytest.raises(OSError):
        warpath.Integrator.load(tmp_path / "none.warp")


def test_the_callback_sees_every_iteration_and_may_stop():
    seen = []
    result = warpath.Integrator([(0, 1)])(lambda x: x[:, 0], nitn=10, neval=1000, callback=lambda r: seen.append(r.sum_neval) or len(seen) == 3)
    assert len(seen) == len(result.itn_results) == 3
    assert result.converged(rtol=0.1) and not result.converged(atol=1e-30)


def test_batches_are_as_small_as_asked_and_may_be_kept():
    kept = []

    def f(x):
        kept.append(x)
        return x[:, 0]

    warpath.Integrator([(0, 1)] * 2)(f, nitn=1, neval=1000, max_batch=100)
    assert max(len(x) for x in kept) == 100
    assert len({float(x[0, 0]) for x in kept}) == len(kept)
    assert not kept[0].flags.writeable


def test_the_table_has_a_line_for_each_iteration():
    integrator = warpath.Integrator([(0, 1)] * 2)
    result = integrator(camel, nitn=4, neval=2000)
    lines = result.summary().splitlines()
    assert lines[0].split() == ["itn", "integral", "wgt", "average", "chi2/dof", "Q"]
    assert len(lines) == 6
    assert str(result) in lines[-1]


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: warpath.Integrator([0, 1]), "D x 2"),
        (lambda: warpath.Integrator([(1, 0)]), "bounds 1 to 0"),
        (lambda: warpath.Integrator([(0, 1)], warp="gird"), 'did you mean "grid"'),
        (lambda: warpath.Integrator([(0, 1)], sampler="halton"), "unknown sampler"),
        (lambda: warpath.Integrator([(0, 1)])(lambda x: x[:, 0], nitn=0), "nitn is 0"),
        (lambda: warpath.Integrator([(0, 1)])(lambda x: x[:, 0], neval=3), "neval is 3"),
        (lambda: warpath.Integrator([(0, 1)])(lambda x: 1.0), "first axis"),
    ],
)
def test_bad_usage_is_a_clear_error(call, text):
    with pytest.raises(ValueError) as error:
        call()
    assert text in str(error.value)


def test_measuring_warns_of_iterations_that_disagree():
    state = iter(range(100))

    def drifting(x):
        return x[:, 0] + next(state)

    with pytest.warns(RuntimeWarning, match="Q ="):
        warpath.Integrator([(0, 1)])(drifting, nitn=3, neval=500, adapt=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warpath.Integrator([(0, 1)])(lambda x: x[:, 0], nitn=3, neval=500)


def test_types_are_installed():
    folder = pathlib.Path(warpath.__file__).parent
    assert (folder / "py.typed").exists()
    assert "class Integrator" in (folder / "_core.pyi").read_text()


def test_nothing_is_drawn_outside_of_the_bounds():
    integrator = warpath.Integrator([(0, 2), (-1, 1)], warp="grid")
    inside, outside = np.array([[0.0, -1.0], [2.0, 1.0], [1.0, 0.0]]), np.array([[-1e-9, 0.0], [1.0, 1.5], [np.nan, 0.0], [np.inf, 0.0]])
    assert np.allclose(integrator.density(inside), 0.25) and np.all(integrator.density(outside) == 0)


@pytest.mark.parametrize("values", [lambda x: x[:, 0] + 1j, lambda x: np.ones((len(x), 2), complex)])
def test_complex_values_are_refused_and_not_cut_short(values):
    with pytest.raises(TypeError, match="two integrals"):
        warpath.Integrator([(0, 1)])(values, nitn=1, neval=1000)
