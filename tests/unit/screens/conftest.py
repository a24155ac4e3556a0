"""Words are compared in the source's language, whatever the test before has left."""
from __future__ import annotations

import pytest

from app.i18n import SOURCE_LANGUAGE, translator


@pytest.fixture(autouse=True)
def source_language() -> None:
    if translator.language != SOURCE_LANGUAGE:
        translator.use(SOURCE_LANGUAGE)
