"""What went wrong, as one sentence in the language the app speaks now."""
from __future__ import annotations

from app.database.errors import DatabaseError
from app.i18n import _
from app.models import InvalidInput
from app.services.mir.errors import RobotError


def sentence_of(problem: BaseException) -> str:
    """Never a traceback and never an exception's class: what nobody foresaw is in the log."""
    match problem:
        case RobotError():
            return _begun(problem.msgid, _(problem.msgid).format_map(problem.params))
        case InvalidInput():
            return _begun(problem.msgid, _(problem.msgid).format(**problem.details))
        case DatabaseError():
            return problem.text
    return _("Something unexpected went wrong; the log file has the details")


def _begun(msgid: str, text: str) -> str:
    """With a capital, unless it begins with a name or an address."""
    return text if msgid.startswith("{") else text[:1].upper() + text[1:]
