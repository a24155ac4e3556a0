"""Something happens in the moment in which a row changes in a certain way."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from app.domain.models import Execution
from app.services.dispatch.ledger import Ledger
from app.services.executions.transitions import Event, Transition


def once(
    monkeypatch: pytest.MonkeyPatch,
    event: Event,
    *,
    before: Callable[[], object] = lambda: None,
    after: Callable[[Sequence[Execution]], object] = lambda rows: None,
) -> None:
    """The first time that the ledger is to make such a transition; ``after`` gets the rows that it has made."""
    apply = Ledger.apply

    def apply_and_act(ledger: Ledger, found: Sequence[Transition], **how: object) -> list[Execution]:
        if not any(each.event is event for each in found):
            return apply(ledger, found, **how)
        monkeypatch.setattr(Ledger, "apply", apply)
        before()
        rows = apply(ledger, found, **how)
        after(rows)
        return rows

    monkeypatch.setattr(Ledger, "apply", apply_and_act)
