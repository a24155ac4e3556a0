"""The figures of groups in words. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.logs.kpi_view import FactLine
from app.services.history.group_kpi import GroupKpis


@dataclass(frozen=True)
class GroupCardView:
    """Values of GroupCard: one group's figures."""

    key: int
    title: str
    note: str
    rows: tuple[FactLine, ...]


def cards(groups: Sequence[GroupKpis]) -> tuple[GroupCardView, ...]:
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


def _rows(group: GroupKpis) -> tuple[FactLine, ...]:
    share = group.in_time_share
    rows = [
        FactLine(
            _("Started within 1 min of plan"),
            formats.percent(share * 100 if share is not None else None),
            _("{n} of {all}").format(n=group.in_time, all=group.starts),
        )
    ]
    if group.wait_p50_s is not None and group.wait_p90_s is not None:
        rows += [
            FactLine(_("Waited for a robot, half within"), formats.duration(group.wait_p50_s)),
            FactLine(_("Nine of ten within"), formats.duration(group.wait_p90_s)),
        ]
    if group.spread is not None:
        used = ", ".join(f"{robot} {formats.percent(share * 100)}" for robot, share in group.used)
        rows.append(FactLine(_("Spread of use"), _("{n} points").format(n=round(group.spread * 100)), used))
    return tuple(rows)
