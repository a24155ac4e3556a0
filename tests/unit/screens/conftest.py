"""Words are compared in the source's language, not in that of the previous test."""

from __future__ import annotations

import gc

import pytest

from app.i18n import SOURCE_LANGUAGE, translator


@pytest.fixture(autouse=True, scope="package")
def no_widgets() -> None:
    """Those of an app that has ended, in a test of another folder, would follow a switch of the language."""
    gc.unfreeze()
    gc.collect()


@pytest.fixture(autouse=True)
def source_language(no_widgets: None) -> None:
    if translator.language != SOURCE_LANGUAGE:
        translator.use(SOURCE_LANGUAGE)
