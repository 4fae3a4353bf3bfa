import math

import numpy as np
import pytest

import warpath

COUNT = 40_000


def g(y):
    """Two peaks over three numbers, each a column."""
    centre = np.where(y[:1] < 0.5, 0.25, 0.75)
    return np.exp(-40 * ((y - centre) ** 2).sum(axis=0))


EXACT = 2 * (math.sqrt(math.pi / 40) * math.erf(math.sqrt(40) / 4)) * (
    0.5 * math.sqrt(math.pi / 40) * (math.erf(math.sqrt(40) / 4) + math.erf(math.sqrt(40) * 3 / 4))) ** 2


def candidates(seed=1):
    asked = warpath.Candidates("film+bounce1.lobe", COUNT, seed)
    for first in range(0, COUNT, 10_000):
        asked.tell(first, g(asked.primary_samples(first, 10_000)))
    return asked


@pytest.mark.parametrize("family, options", [("grid", {}), ("kdtree", {}), ("realnvp", {"max_steps": 300}), ("spline", {"max_steps": 300})])
def test_every_family_draws_without_bias_and_with_less_variance(family, options):
    warp = warpath.train(candidates(), family, epp=0.2, **options)
    y, inv_q = warp.draw(0, COUNT, seed=2)
    assert y.shape == (3, COUNT) and y.min() >= 0 and y.max() < 1
    estimate = g(y) * inv_q
    error = estimate.std() / math.sqrt(COUNT)
    assert abs(estimate.mean() - EXACT) < 5 * error  # by chance in 6e7
    uniform = g(candidates().primary_samples(0, COUNT))
    assert estimate.std() < 0.7 * uniform.std()
    # The density of what was drawn is the one that it was divided by, up to the rounding of y to float.
    assert np.allclose(warp.density(y.T) * inv_q, 1, rtol=1e-2)


def test_a_warp_is_a_file(tmp_path):
    warp = warpath.train(candidates(), "kdtree")
    warp.save(tmp_path / "two.warp")
    again = warpath.Warp.load(tmp_path / "two.warp")
    assert again.layout.name == "film+bounce1.lobe" and again.settings["method"] == "kdtree:film+bounce1.lobe"
    assert np.array_equal(again.draw(5, 1000)[0], warp.draw(5, 1000)[0])
    with pytest.raises(OSError):
        warpath.Warp.load(tmp_path / "none.warp")


def test_samples_are_a_function_of_seed_and_number():
    warp = warpath.train(candidates(), "grid")
    whole, _ = warp.draw(0, 4096, seed=3, stratified=False)
    assert np.array_equal(warp.draw(1000, 500, seed=3, stratified=False)[0], whole[:, 1000:1500])
    assert not np.array_equal(warp.draw(0, 4096, seed=4)[0], whole)
    asked = warpath.Candidates("film", 10, seed=3)
    assert not np.array_equal(asked.primary_samples(0, 10), warpath.Candidates("film", 10, seed=4).primary_samples(0, 10))


def test_targets_that_are_no_numbers_count_as_zero():
    asked = warpath.Candidates("film", 4)
    asked.tell(0, np.array([np.nan, np.inf, -1, 1]))
    assert asked.non_finite == 3


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: warpath.Layout("flim"), 'unknown dimension "flim"'),
        (lambda: warpath.train(candidates(), "gird"), 'did you mean "grid"'),
        (lambda: warpath.train(candidates(), "grid", epq=1), 'unknown option "epq"; did you mean "epp"?'),
        (lambda: warpath.train(candidates(), "realnvp", loss="chi2"), 'loss: unknown value "chi2"; known: variance, likelihood'),
        (lambda: warpath.train(candidates(), "realnvp", rate=float("nan")), 'rate: "nan" is not a number, above 0 to 1'),
        (lambda: warpath.train(candidates(), "grid", couplings=3), "couplings: grid does not use it; it is for realnvp, spline"),
        (lambda: warpath.train(candidates(), "grid", uniform=0.1), "uniform is now called uniform_share"),
        (lambda: warpath.Candidates("film", 10).primary_samples(5, 6), "not so many candidates"),
    ],
)
def test_bad_usage_is_a_clear_error(call, text):
    with pytest.raises(ValueError) as error:
        call()
    assert text in str(error.value)
