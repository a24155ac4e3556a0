"""How thoroughly hypothesis looks."""

from __future__ import annotations

from typing import Any

from hypothesis import settings


def examples(number: int, **others: Any) -> settings:
    """``number`` examples in the profile "thorough", and in any other a share of them."""
    return settings(max_examples=max(5, number * settings().max_examples // 100), **others)
