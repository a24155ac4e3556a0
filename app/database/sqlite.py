"""What every connection of the app has in common."""

from __future__ import annotations

import sqlite3


def configured(connection: sqlite3.Connection) -> sqlite3.Connection:
    """The same connection, as every part of the app expects it and no file can turn it against the app."""
    connection.row_factory = sqlite3.Row
    connection.create_function(
        "casefold", 1, str.casefold, deterministic=True
    )  # SQLite itself knows the case of ASCII only
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.execute("PRAGMA secure_delete = ON")  # tokens that were replaced are not to be found in the file
    connection.execute("PRAGMA cell_size_check = ON")
    connection.execute("PRAGMA mmap_size = 0")
    return connection
