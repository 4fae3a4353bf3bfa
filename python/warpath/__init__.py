"""Learned importance sampling: integrates any function, and learns where its points matter."""

from importlib.metadata import version

from .integrator import Integrator, Sample
from .result import Result
from .training import Candidates, Group, Layout, Warp, train

__all__ = ["Candidates", "Group", "Integrator", "Layout", "Result", "Sample", "Warp", "train"]
__version__ = version("warpath")
