"""Errors of images, and confidence intervals of repeated runs."""
import math
import statistics

import numpy as np

# As in the comparisons of the API: relMSE is the mean of (a - b)^2 / (b^2 + 0.01).
REGULARIZER = 0.01
WORST_SHARE = 0.001

# Student's t, 97.5% quantile, for 1 to 30 degrees of freedom (NIST/SEMATECH e-Handbook,
# 1.3.6.7.2); beyond: normal.
T_QUANTILES = (
    12.706,
    4.303,
    3.182,
    2.776,
    2.571,
    2.447,
    2.365,
    2.306,
    2.262,
    2.228,
    2.201,
    2.179,
    2.160,
    2.145,
    2.131,
    2.120,
    2.110,
    2.101,
    2.093,
    2.086,
    2.080,
    2.074,
    2.069,
    2.064,
    2.060,
    2.056,
    2.052,
    2.048,
    2.045,
    2.042,
)


def interval(values):
    """Mean and the half width of its 95% interval; for a single value the half width is unknown.
    """
    values = [float(v) for v in values]
    mean = statistics.fmean(values)
    freedom = len(values) - 1
    if freedom < 1:
        return mean, math.nan
    quantile = T_QUANTILES[freedom - 1] if freedom <= len(T_QUANTILES) else 1.960
    return mean, quantile * statistics.stdev(values) / math.sqrt(len(values))


def ratio_interval(over, under):
    """Geometric mean of over[i] / under[i] with its 95% interval, for interleaved runs.

    Unknown (nan) if a value is not above 0, which happens for errors below the noise of their
    reference.
    """
    if min(*over, *under) <= 0:
        return math.nan, math.nan, math.nan
    mean, half = interval([math.log(a / b) for a, b in zip(over, under, strict=True)])
    return math.exp(mean), math.exp(mean - half), math.exp(mean + half)


class Reference:
    """The mean of several long renders with its own variance, which is subtracted from the errors
    against it."""

    def __init__(self, pictures):
        stack = np.asarray(pictures, dtype=np.float64)
        self.mean = stack.mean(axis=0)
        self.variance = (stack.var(axis=0, ddof=1) / len(stack) if len(stack) > 1
                         else np.zeros_like(self.mean))

    def pixel_errors(self, picture, weight=None):
        """Relative squared error of each pixel, minus the noise of this reference.

        weight: the image whose luminance normalises the errors; by default this reference.
        """
        bright = self.mean if weight is None else weight
        error = (np.asarray(picture, dtype=np.float64) - self.mean) ** 2 - self.variance
        return (error / (bright ** 2 + REGULARIZER)).mean(axis=-1)

    def brightness(self):
        """Mean over the image, and its standard error."""
        return float(self.mean.mean()), float(np.sqrt(self.variance.sum()) / self.variance.size)


def relative_mse(errors):
    return float(np.mean(errors))


def without_worst(errors, share=WORST_SHARE):
    """The mean without the worst pixels; by default 0.1% of them."""
    flat = np.sort(np.asarray(errors).ravel())
    return float(flat[:len(flat) - math.ceil(share * len(flat))].mean())


def relative_variances(pictures):
    """Variance of each pixel between renders, relative to the square of its mean luminance; dark
    pixels to a hundredth of the image's."""
    stack = np.asarray(pictures, dtype=np.float64)
    mean = stack.mean(axis=0).mean(axis=-1)
    return stack.var(axis=0, ddof=1).mean(axis=-1) / (mean ** 2 + (0.01 * mean.mean()) ** 2)


def difference(a, b):
    """Relative mean squared difference of two references minus the noise of both, and its standard
    error."""
    if a is b:
        return 0.0, 0.0
    error = ((a.mean - b.mean) ** 2 - a.variance - b.variance) / (b.mean ** 2 + REGULARIZER)
    return float(error.mean()), float(error.std() / math.sqrt(error.size))


def most_agreed(references):
    """The engine whose reference differs least from all others'; Tessera only if it is alone."""
    peers = [name for name in references if not name.endswith("tessera")] or list(references)
    if not peers:
        return None
    return min(peers, key=lambda name: sum(
        max(difference(other, references[name])[0], 0) for other in references.values()))


def efficiency(error, cpu_seconds, threads):
    """1 / (V T), where T is the CPU time if all threads work."""
    return threads / (error * cpu_seconds) if error > 0 and cpu_seconds > 0 else math.nan
