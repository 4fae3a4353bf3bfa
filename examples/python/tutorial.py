# %% [markdown]
# # Learning where samples matter
#
# A tutorial that runs: as a script (`python examples/python/tutorial.py [FOLDER]`; pictures go to FOLDER), or cell by cell where `# %%` means one
# (Jupyter with jupytext, VS Code, Spyder). It needs `pip install . matplotlib`, and `mitsuba` for the fourth part.

# %%
import math
import os
import pathlib
import sys
import warnings

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import warpath

FOLDER = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/tutorial")
FOLDER.mkdir(parents=True, exist_ok=True)


def keep(figure, name):
    figure.savefig(FOLDER / f"{name}.png", dpi=110, bbox_inches="tight")
    plt.close(figure)


# %% [markdown]
# ## 1. A first integral
#
# Two peaks in four dimensions. The function gets many points at once, N x 4, and returns N values. First the integrator adapts: each
# iteration teaches it where the function is large. Then it measures with a warp that no longer changes; that estimate has no bias.

# %%
def two_peaks(x):
    return sum(np.exp(-60 * ((x - centre) ** 2).sum(axis=1)) for centre in (0.3, 0.7))


edges = math.erf(0.3 * math.sqrt(60)) + math.erf(0.7 * math.sqrt(60))  # of one peak, one dimension, cut off by the box
exact = 2 * (math.sqrt(math.pi / 60) * edges / 2) ** 4
integrator = warpath.Integrator([(0, 1)] * 4)
adaptation = integrator(two_peaks, nitn=6, neval=20_000)
result = integrator(two_peaks, nitn=5, neval=20_000, adapt=False)
print(result.summary())
print(f"measured {result}, exactly {exact:.6g}; {integrator.warp} draws")
print(f"{result.effective_samples:.0f} of {result.itn_results[-1].neval} points are effective")

# %% [markdown]
# The error of each iteration falls while the warp learns, and the points gather where the function is.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
iterations = adaptation.itn_results + result.itn_results
left.semilogy(range(1, 1 + len(iterations)), [i.sdev() / exact for i in iterations], "o-")
left.axvline(6.5, color="grey", lw=1)
left.set(xlabel="iteration (grey: adaptation ends)", ylabel="relative standard error", title="Error of each iteration")
points = integrator.sample(4000).x
right.plot(points[:, 0], points[:, 1], ".", ms=2)
right.set(xlabel="$x_1$", ylabel="$x_2$", title="Where points go", aspect="equal", xlim=(0, 1), ylim=(0, 1))
keep(figure, "first-integral")

# %% [markdown]
# ## 2. Your own integrand
#
# Bounds may be anything finite. Several integrals at once share the points: here a mass and the two moments that make a centre, whose
# covariance gives the error of the ratio. The warp adapts to the first of them.

# %%


def moon(x):
    """A thin crescent, and its first moments."""
    radius = np.hypot(x[:, 0], x[:, 1])
    mass = np.exp(-400 * (radius - 1) ** 2) * (1 + np.tanh(4 * x[:, 1]))
    return np.stack([mass, mass * x[:, 0], mass * x[:, 1]], axis=1)


bounds = [(-2, 2), (-2, 2)]
crescent = warpath.Integrator(bounds, seed=1)
crescent(moon, nitn=8, neval=10_000)
result = crescent(moon, nitn=8, neval=10_000, adapt=False, callback=lambda so_far: so_far.converged(rtol=2e-3, atol=2e-3))
ratio = result.mean[2] / result.mean[0]
gradient = np.array([-ratio, 0, 1]) / result.mean[0]
print(f"centre at y = {ratio:.4f} +- {np.sqrt(gradient @ result.cov @ gradient):.4f} after {len(result.itn_results)} iterations")

# %% [markdown]
# What was learned can be looked at, kept, and used without calling the function again.

# %%
crescent.save(FOLDER / "crescent.warp")
again = warpath.Integrator.load(FOLDER / "crescent.warp")
axis = np.linspace(-1.99, 1.99, 160)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
figure, axes = plt.subplots(1, 2, figsize=(9, 4))
for ax, values, title in zip(axes, (moon(grid)[:, 0], again.density(grid)), ("The integrand", "Density of the points")):
    ax.imshow(values.reshape(160, 160), extent=(-2, 2, -2, 2), origin="lower")
    ax.set_title(title)
keep(figure, "own-integrand")

# %% [markdown]
# ## 3. When it does not help
#
# A peak that holds a millionth of the volume: the first points do not meet it, and an integrator can only learn from what it has seen. The
# signs are a Q below 0.05, iterations that jump, and few effective samples.

# %%


def needle(x):
    return np.exp(-(((x - 0.62) / 0.004) ** 2).sum(axis=1))


exact = (0.004 * np.sqrt(np.pi)) ** 3
timid = warpath.Integrator([(0, 1)] * 3, seed=2)
with warnings.catch_warnings():
    warnings.simplefilter("ignore", RuntimeWarning)  # here it is expected that iterations disagree
    timid(needle, nitn=3, neval=500)
    missed = timid(needle, nitn=5, neval=500, adapt=False)
print(f"too few points: {missed}, exactly {exact:.4g}; Q {missed.Q:.2g}, effective samples {missed.effective_samples:.1f}")

# %% [markdown]
# What to do: more points while adapting, until some meet the peak; and variables in which it is wider. Both work here.

# %%
bold = warpath.Integrator([(0, 1)] * 3, seed=2)
bold(needle, nitn=8, neval=100_000)
found = bold(needle, nitn=5, neval=20_000, adapt=False)


def in_wider_variables(t):
    """x = 0.62 + s^3 stretches the surroundings of 0.62; the determinant comes with it."""
    return needle(0.62 + t**3) * np.prod(3 * t**2, axis=1)


edge = np.cbrt([-0.62, 0.38])
wide = warpath.Integrator([edge] * 3, seed=2)
wide(in_wider_variables, nitn=5, neval=5_000)
stretched = wide(in_wider_variables, nitn=5, neval=5_000, adapt=False)
print(f"more points: {found}; wider variables, a twentieth of the points: {stretched}; exactly {exact:.4g}")
figure, ax = plt.subplots(figsize=(6, 3.5))
attempts = {"500 points\nan iteration": missed, "100,000 points\nan iteration": found, "5,000 points,\nwider variables": stretched}
for k, one in enumerate(attempts.values()):
    ax.errorbar([k], [one.mean / exact], yerr=[one.sdev / exact], fmt="o", capsize=4)
ax.axhline(1, color="grey", lw=1)
ax.set(ylabel="estimate / exact value", xticks=range(3), xticklabels=attempts, xlim=(-0.5, 2.5), title="A needle")
keep(figure, "does-not-help")

# %% [markdown]
# ## 4. A scene of Mitsuba 3
#
# A renderer is a function of random numbers too. `warpath.mitsuba` trains a warp of some of them (here the film position and the direction
# of the first bounce) and renders with it; scene and integrator stay as they are. The LLVM variant is for real use; the scalar one needs
# nothing but patience, so the picture is small. With the film among the warped numbers bright regions get more samples: MSE falls, relative
# error in the dark may not.

# %%
try:
    import mitsuba as mi
except ImportError:
    mi = None
    print("Mitsuba 3 is not installed: pip install mitsuba")
if mi:
    # LLVM before 19 ends the process on CPUs with AVX-512: point DRJIT_LIBLLVM_PATH to a newer one.
    fast = "DRJIT_LIBLLVM_PATH" in os.environ
    mi.set_variant("llvm_ad_rgb" if fast else "scalar_rgb")
    import warpath.mitsuba

    size, spp = (128, 64) if fast else (24, 16)
    box = mi.cornell_box()
    box["sensor"]["film"].update(width=size, height=size)
    scene = mi.load_dict(box)
    warp = warpath.mitsuba.train(scene, "kdtree:film+bounce1", epp=2 if fast else 0.1)
    images = {
        "Mitsuba": np.array(mi.render(scene, spp=spp)),
        "the same, directly seen light apart": np.array(warpath.mitsuba.render(scene, spp, "none")),
        "kd-tree": np.array(warpath.mitsuba.render(scene, spp, warp)),
    }
    reference = np.array(mi.render(scene, spp=16 * spp, seed=1))
    figure, axes = plt.subplots(1, 3, figsize=(11, 4))
    for ax, (name, image) in zip(axes, images.items()):
        ax.imshow(np.clip(image, 0, 1) ** (1 / 2.2))
        ax.set_title(f"{name}\nMSE {np.mean((image - reference) ** 2):.2g}", fontsize=9)
        ax.axis("off")
    keep(figure, "mitsuba-scene")
    for name, image in images.items():
        print(f"{name}: mean {image.mean():.4f}, MSE {np.mean((image - reference) ** 2):.3g}")

# %% [markdown]
# What next: [Integrate any function](../../docs/integrate.md), the [user guide](../../docs/guide.md) for the renderer of the project, the
# [API](../../docs/api.md).
