"""Reading the files that people bring in: never more than is taken of them."""

from __future__ import annotations

from pathlib import Path

from app.domain.message import message_of_system
from app.domain.models import InvalidInput
from app.services.catalogue.configuration.document import LARGEST_FILE


def read_file(source: Path, *, may_be_pipe: bool = False) -> bytes:
    """The bytes of a file to import, at most 5 MiB. Raises InvalidInput("path", …).

    A pipe may never end, so only a command, which can be interrupted, reads one.
    """
    if not may_be_pipe and source.exists() and not (source.is_file() or source.is_dir()):
        raise InvalidInput("path", "{path} is no plain file", path=source)
    try:
        with source.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise InvalidInput("path", "there is no file {path}", path=source) from None
    except OSError as error:
        raise InvalidInput(
            "path", "{path} can't be read: {problem}", path=source, problem=message_of_system(error)
        ) from None
    if len(content) > LARGEST_FILE:
        raise InvalidInput("path", "{path} is larger than 5 MiB", path=source)
    return content
