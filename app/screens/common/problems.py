"""What went wrong, as one sentence in the language of the app."""

from __future__ import annotations

from typing import TypeGuard

from app.database.errors import DatabaseError
from app.domain.message import Message, is_message, message_of, render
from app.domain.models import InvalidInput
from app.failures import Failure
from app.i18n import _
from app.mir.errors import RobotError


def sentence_of(problem: BaseException) -> str:
    """Never a traceback or the name of an exception: what is unexpected is in the log."""
    if isinstance(problem, Failure):
        cause = problem.__cause__
        return sentence_of(cause) if isinstance(cause, DatabaseError) else str(problem)
    if isinstance(problem, RobotError | InvalidInput | DatabaseError):
        return words_of(message_of(problem))
    return _("Something unexpected went wrong. The log file has the details")


def is_of_robot(problem: BaseException) -> TypeGuard[RobotError]:
    """Whether its sentence calls a robot by its address, and not that robot's fleet."""
    return isinstance(problem, RobotError) and "{address}" in problem.msgid and "fleet" not in problem.msgid


def words_of(problem: Message) -> str:
    """With a capital, unless it begins with a name or an address; plain text, such as a robot's, stays unchanged."""
    text = render(problem, _)
    return text if not is_message(problem) or problem["msgid"].startswith("{") else text[:1].upper() + text[1:]
