"""Mitsuba 3 as the black box: any scene, any integrator that samples rays, drawn with warped numbers.

Importing this needs the package `mitsuba`, and a variant for RGB: `mitsuba.set_variant("llvm_ad_rgb")` for real use.
"""

try:
    import mitsuba as _mitsuba  # noqa: F401
except ImportError as error:
    raise ImportError("warpath.mitsuba needs Mitsuba 3: pip install mitsuba") from error

from .estimator import render, train
from .plugin import register

__all__ = ["register", "render", "train"]
