"""Something happens in the moment in which a row changes in a certain way."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.domain.execution import Execution
from app.services.dispatch.ledger import Ledger
from app.services.executions.transitions import Event, Transition


def once(
    ledger: Ledger,
    event: Event,
    *,
    before: Callable[[], object] = lambda: None,
    after: Callable[[Sequence[Execution]], object] = lambda rows: None,
) -> None:
    """The first time that the ledger is to make such a transition; ``after`` gets the rows that it has made."""

    def apply(found: Sequence[Transition], **how: object) -> list[Execution]:
        if not any(each.event is event for each in found):
            return Ledger.apply(ledger, found, **how)  # type: ignore[arg-type]
        del ledger.apply
        before()
        rows = ledger.apply(found, **how)  # type: ignore[arg-type]
        after(rows)
        return rows

    ledger.apply = apply  # type: ignore[method-assign]
