"""Confidence intervals of shares."""

from __future__ import annotations

from math import sqrt

Z_95 = 1.959964  # standard normal, two-sided 95 %


def wilson(successes: int, cases: int, z: float = Z_95) -> tuple[float, float] | None:
    """The score interval (Wilson 1927) of a share, both ends 0–1, for ``z`` of the standard normal; None without
    cases."""
    if cases <= 0:
        return None
    share, z2 = successes / cases, z**2
    middle = share + z2 / (2 * cases)
    spread = z * sqrt(share * (1 - share) / cases + z2 / (4 * cases**2))
    scale = 1 + z2 / cases
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)
