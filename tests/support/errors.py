"""What has to be raised, and what it has to say."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.models import InvalidInput


def raises(kind: type[Exception] | tuple[type[Exception], ...], match: str | None = None, **values: Any) -> Any:
    """An error of that kind whose attributes have these values."""
    return pytest.raises(
        kind, match=match, check=lambda error: {name: getattr(error, name) for name in values} == values
    )


def refuses(field: str, problem: str | None = None) -> Any:
    """What a person has entered in that field."""
    return raises(InvalidInput, problem, field=field)
