"""Errors that end the process with one line on stderr and an exit code."""


class Failure(Exception):
    """Something went wrong; exit code 1."""


class BadInput(Failure):
    """The request or its values can't be accepted, and nothing was changed; exit code 2."""
