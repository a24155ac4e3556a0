"""The figures of groups in words. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.logs.kpi_view import FactLine, in_unit
from app.services.history.figures import GROUP_FIGURES, GroupFacts


@dataclass(frozen=True)
class GroupCardView:
    """Values of GroupCard: one group's figures."""

    key: int
    title: str
    note: str
    rows: tuple[FactLine, ...]


def cards(groups: Sequence[GroupFacts]) -> tuple[GroupCardView, ...]:
    """One for each group with starts in the period."""
    return tuple(
        GroupCardView(
            group.group_id,
            _("Any of {group}").format(group=group.group),
            ngettext("{n} start", "{n} starts", group.starts).format(n=group.starts),
            _rows(group),
        )
        for group in groups
    )


def _rows(group: GroupFacts) -> tuple[FactLine, ...]:
    """Unknown ones are omitted, except the first: it says that there were no starts."""
    notes = {
        "in_time": _("{n} of {all}").format(n=group.in_time, all=group.starts),
        "spread": ", ".join(f"{robot} {formats.percent(share * 100)}" for robot, share in group.used),
    }
    return tuple(
        FactLine(_(figure.title), in_unit(value, figure.unit), notes.get(key, ""))
        for key, figure in GROUP_FIGURES.items()
        if (value := figure.compute(group)) is not None or key == "in_time"
    )
