"""Learned importance sampling: integrates any function, and learns where its points matter."""

from importlib.metadata import version

from .integrator import Integrator, Sample
from .result import Result

__all__ = ["Integrator", "Result", "Sample"]
__version__ = version("warpath")
