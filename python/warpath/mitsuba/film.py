"""Sums of samples under the film's filter."""

from __future__ import annotations

import mitsuba as mi
import numpy as np


class Film:
    """Splats samples as Mitsuba does, over the crop window. Sums of passes are in double.

    expected: divides each pixel by what uniform positions would have brought, for samples that fall where a warp puts them
    (unbiased); else by the weights that fell, as Mitsuba does (consistent).
    """

    def __init__(self, film: mi.Film, expected: bool):
        self._filter = film.rfilter()
        self.width, self.height = (int(size) for size in np.array(film.crop_size()))
        self._expected = expected
        self._sums = np.zeros((self.height, self.width, 4))
        self.samples = 0

    def add(self, position, value) -> None:
        """N samples: 2 positions in pixels of the crop window and 3 values each, as drjit or NumPy arrays."""
        self._sums += self._splat(self.width, self.height, position, value)
        self.samples += np.shape(position)[1]

    def _splat(self, width: int, height: int, position, value) -> np.ndarray:
        block = mi.ImageBlock([width, height], [0, 0], 4, self._filter, border=False, coalesce=False, warn_negative=False, warn_invalid=False)
        if mi.variant().startswith("scalar"):
            for i in range(np.shape(position)[1]):
                block.put(mi.Point2f(*map(float, position[:, i])), [*map(float, value[:, i]), 1.0])
        else:
            value = mi.Color3f(value)
            block.put(mi.Point2f(position), [value.x, value.y, value.z, mi.Float(1)])
        return np.array(block.tensor(), float)

    def _expected_weight(self) -> np.ndarray:
        """Mean weight of uniform positions in each pixel, by the same splatting: the filter is a product of one along each axis."""
        points = 64

        def along(length: int) -> np.ndarray:
            x = (np.arange(points * length) + 0.5) / points
            row = self._splat(length, 1, np.stack([x, np.full_like(x, 0.5)]).astype(np.float32), np.zeros((3, len(x)), np.float32))
            return row[0, :, 3] / points

        centre = self._splat(1, 1, np.full((2, 1), 0.5, np.float32), np.zeros((3, 1), np.float32))[0, 0, 3]
        # Each of the two holds the other's axis at its centre.
        return np.outer(along(self.height), along(self.width)) / centre

    def develop(self) -> np.ndarray:
        """H x W x 3, linear RGB; black where no sample fell."""
        if self._expected:
            weight = self._expected_weight() * (self.samples / (self.width * self.height))
        else:
            weight = self._sums[:, :, 3]
        return np.divide(self._sums[:, :, :3], weight[:, :, None], out=np.zeros_like(self._sums[:, :, :3]), where=weight[:, :, None] > 0)
