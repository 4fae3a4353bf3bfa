"""Learned importance sampling: integrates any function, and learns where its points matter."""

from importlib.metadata import version

from .integrator import Integrator, Sample
from .renderer import Image, Scene, load_scene, render
from .result import Result
from .training import Candidates, Group, Layout, Warp, train

__all__ = ["Candidates", "Group", "Image", "Integrator", "Layout", "Result", "Sample", "Scene", "Warp", "load_scene", "render", "train"]
__version__ = version("warpath")
