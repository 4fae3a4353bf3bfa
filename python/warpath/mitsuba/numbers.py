"""The sampler that hands a nested integrator its numbers, some of them warped.

An integrator asks for one or two numbers at a time and does not say for what. The order in which Mitsuba 3 asks is known: at each
vertex two for the light (its choice and the position on it), one for the lobe of the BSDF, two for the direction, one for Russian
roulette. `Order` follows the questions as a finite automaton, with a state for each lane.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..training import Layout

# One vertex: what a question for one or two numbers means in each state, and the state after it; None is the start of the next vertex.
# Scalar variants leave out the light at specular surfaces, and some integrators ask for the direction before the lobe.
_SCATTER = {
    "start": {2: ("light_uv", "light"), 1: ("lobe", "lobe")},
    "light": {1: ("lobe", "lobe"), 2: ("dir", "dir")},
    "lobe": {2: ("dir", "done"), 1: ("rr", None)},
    "dir": {1: ("lobe", "done"), 2: ("", "dir")},
}
_VERTEX = {
    "PathIntegrator": _SCATTER | {"done": {1: ("rr", None), 2: ("", "done")}},
    "DirectIntegrator": _SCATTER | {"done": {1: ("", "done"), 2: ("", "done")}},
    # A colour channel first of all; roulette begins a vertex, and its direction ends it.
    "VolumetricPathIntegrator": {
        "start": {1: ("rr", "light?"), 2: ("light_uv", "light")},
        "light?": {2: ("light_uv", "light"), 1: ("lobe", "lobe")},
        "light": {1: ("lobe", "lobe"), 2: ("dir", "dir")},
        "lobe": {2: ("dir", None), 1: ("", "lobe")},
        "dir": {1: ("lobe", None), 2: ("", "dir")},
        "channel": {1: ("", "start"), 2: ("", "channel")},
    },
}
# A state is 8 (bounce - 1) + the place of its name.
_NAMES = 8


class Answer(NamedTuple):
    """In `state`, the question is for the numbers that begin in this column of y."""

    state: int
    column: int


class Order:
    """What an integrator asks for, and which columns of y answer, for a layout.

    Attributes:
        camera: the columns of film, lens and time.
        answers: by how many numbers are asked for.
        following: by the same, a nibble for each name of a state: the name that follows, plus 8 if the next vertex begins. An
            shift and an addition then move a state on.
        first: the state that a path begins in.
    """

    def __init__(self, integrator: mi.Integrator, layout: Layout | None, has_media: bool = False):
        integrator_name = integrator.class_name()
        if integrator_name not in _VERTEX:
            raise ValueError(f"the order of the numbers of a {integrator_name} is not known; known: path, direct and volpath")
        vertex = _VERTEX[integrator_name]
        names = list(vertex)
        self.camera: dict[str, int] = {}
        self.answers: dict[int, list[Answer]] = {1: [], 2: []}
        self.following = {size: sum(self._next(names, vertex[name][size][1]) << 4 * i for i, name in enumerate(names)) for size in (1, 2)}
        self.first = names.index("channel") if "channel" in names else 0
        column = 0
        for group in layout.groups if layout else []:
            self._check(group, integrator_name, has_media)
            if group.bounce == 0:
                self.camera[group.name] = column
            else:
                states = [i for i, name in enumerate(names) if vertex[name][group.size][0] == group.kind]
                self.answers[group.size] += [Answer(_NAMES * (group.bounce - 1) + i, column) for i in states]
            column += group.size

    @staticmethod
    def _next(names: list[str], name: str | None) -> int:
        return _NAMES if name is None else names.index(name)

    @staticmethod
    def _check(group: Any, integrator: str, has_media: bool) -> None:
        if group.kind == "light":
            raise ValueError(f"{group.name}: Mitsuba draws the choice of light and the position on it from the same two numbers; "
                             f"bounce{group.bounce}.light_uv means both")
        if integrator == "DirectIntegrator" and (group.bounce > 1 or group.kind == "rr"):
            raise ValueError(f"{group.name}: the integrator `direct` has one bounce, without roulette")
        if has_media and group.bounce > 0:
            raise ValueError(f"{group.name}: in scenes with participating media only film, lens and time can be warped")

    def after(self, state, size: int):
        """The state that follows a question for `size` numbers, for one lane or all."""
        index = (state & (_NAMES - 1)) * 4
        following = mi.UInt32(self.following[size]) if isinstance(state, mi.UInt32) else self.following[size]
        return (state - (state & (_NAMES - 1))) + ((following >> index) & 15)


@lru_cache(maxsize=None)
def sampler_class(variant: str) -> type:
    """The sampler as a class of the variant, which must be the one that is set."""
    return _scalar_class() if variant.startswith("scalar") else _jit_class()


def _jit_class() -> type:
    class WarpedSampler(mi.Sampler):
        """Lane i of a wavefront gets column i of y."""

        def __init__(self, props: mi.Properties | None = None):
            super().__init__(props or mi.Properties())
            self.state, self.random, self.lane, self.count, self.numbers = mi.UInt32(0), mi.PCG32(), mi.UInt32(0), mi.UInt32(1), mi.Float(0)

        def start(self, order: Order, y: np.ndarray, seed: int) -> None:
            """y: D x N, the numbers that are given; all others come from PCG32 of this seed."""
            self.order, count = order, y.shape[1]
            self.numbers = mi.Float(np.ascontiguousarray(y, np.float32).ravel())
            self.count = dr.opaque(mi.UInt32, count)
            self.lane = dr.arange(mi.UInt32, count)
            self.state = dr.full(mi.UInt32, order.first, count)
            state, stream = mi.sample_tea_32(dr.opaque(mi.UInt32, seed % 2**32), self.lane)
            self.random = mi.PCG32(size=count, initstate=mi.UInt64(state), initseq=mi.UInt64(stream))

        def of_column(self, column: int, active: Any = True) -> mi.Float:
            return dr.gather(mi.Float, self.numbers, self.count * column + self.lane, active)

        def _ask(self, size: int, active: Any) -> list[mi.Float]:
            numbers = [self.random.next_float32(active) for _ in range(size)]
            for answer in self.order.answers[size]:
                here = mi.Bool(active) & (self.state == answer.state)
                numbers = [dr.select(here, self.of_column(answer.column + i, here), number) for i, number in enumerate(numbers)]
            self.state = dr.select(active, self.order.after(self.state, size), self.state)
            return numbers

        def next_1d(self, active: Any = True) -> mi.Float:
            return self._ask(1, active)[0]

        def next_2d(self, active: Any = True) -> mi.Point2f:
            return mi.Point2f(self._ask(2, active))

        def fork(self) -> mi.Sampler:
            return WarpedSampler()

        def clone(self) -> mi.Sampler:
            return WarpedSampler()

    return WarpedSampler


def _scalar_class() -> type:
    class WarpedSampler(mi.Sampler):
        """One path at a time: `go_to(i)` before each."""

        def __init__(self, props: mi.Properties | None = None):
            super().__init__(props or mi.Properties())
            self.random, self.state, self.lane = mi.PCG32(), 0, 0

        def start(self, order: Order, y: np.ndarray, seed: int) -> None:
            self.order, self.numbers, self.seed = order, y, seed

        def go_to(self, lane: int) -> None:
            state, stream = mi.sample_tea_32(self.seed % 2**32, lane)
            self.lane, self.state, self.random = lane, self.order.first, mi.PCG32(initstate=state, initseq=stream)

        def of_column(self, column: int) -> float:
            return float(self.numbers[column, self.lane])

        def _ask(self, size: int) -> list[float]:
            column = next((answer.column for answer in self.order.answers[size] if answer.state == self.state), None)
            self.state = self.order.after(self.state, size)
            return [self.random.next_float32() if column is None else self.of_column(column + i) for i in range(size)]

        def next_1d(self, active: bool = True) -> float:
            return self._ask(1)[0]

        def next_2d(self, active: bool = True) -> mi.Point2f:
            return mi.Point2f(self._ask(2))

        def fork(self) -> mi.Sampler:
            return WarpedSampler()

        def clone(self) -> mi.Sampler:
            return WarpedSampler()

    return WarpedSampler
