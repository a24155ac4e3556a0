"""Errors that end the process with one line on stderr and an exit code."""


class Failure(Exception):
    """Something went wrong; exit code 1."""


class BadInput(Failure):
    """What was asked for or given can't be taken, and nothing was changed; exit code 2."""
