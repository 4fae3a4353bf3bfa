"""Student's one-sided t-test, with nothing but the standard library."""

import math

from tables import mean, standard_error


def upper_tail(t, freedom):
    """Probability that Student's t exceeds `t`: Simpson's rule over the angle atan(t / sqrt(freedom)), where the density is a power of a cosine."""
    steps = 2000
    low, high = math.atan(t / math.sqrt(freedom)), math.pi / 2
    width = (high - low) / steps
    heights = [max(0.0, math.cos(low + k * width)) ** (freedom - 1) for k in range(steps + 1)]
    total = width / 3 * (heights[0] + heights[-1] + 4 * sum(heights[1:-1:2]) + 2 * sum(heights[2:-1:2]))
    return total * math.exp(math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2)) / math.sqrt(math.pi)


def chance_of_mean(values):
    """How likely so large a mean is by chance, if the values are independent, normal, and 0 in the mean; 1 if they do not vary at all."""
    error = standard_error(values)
    return upper_tail(mean(values) / error, len(values) - 1) if error > 0 else 1.0
