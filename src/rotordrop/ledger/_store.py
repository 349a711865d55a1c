"""Where a log of drops is kept: a SQLite file, or a PostgreSQL data base by URL."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from rotordrop.errors import OutputError, UsageError

WAIT = 60.0
"""How long a writer waits for others [s]; chosen, not measured."""
PAUSE = 0.02
"""Pause before a log that is being made is looked at again [s]; chosen, not measured."""

TABLES = (
    """CREATE TABLE IF NOT EXISTS drops (
        id {serial},
        machine TEXT NOT NULL, bearing_set TEXT NOT NULL,
        record TEXT NOT NULL, sha256 TEXT NOT NULL,
        recorded TEXT NOT NULL, added TEXT NOT NULL,
        speed {real} NOT NULL, duration {real}, cause TEXT NOT NULL,
        method TEXT NOT NULL, verdict TEXT NOT NULL, simulated BOOLEAN NOT NULL,
        version TEXT NOT NULL, fingerprint TEXT NOT NULL,
        UNIQUE (machine, bearing_set, sha256))""",
    """CREATE TABLE IF NOT EXISTS severity (
        drop_id INTEGER NOT NULL REFERENCES drops (id) ON DELETE CASCADE,
        bearing TEXT NOT NULL, quantity TEXT NOT NULL, unit TEXT NOT NULL,
        value {real}, lower {real} NOT NULL, upper {real} NOT NULL,
        PRIMARY KEY (drop_id, bearing, quantity))""",
    """CREATE TABLE IF NOT EXISTS allowances (
        machine TEXT NOT NULL, bearing_set TEXT NOT NULL,
        drops INTEGER, seconds {real}, source TEXT NOT NULL,
        PRIMARY KEY (machine, bearing_set))""",
)


class Transaction:
    """One transaction: statements with ``?`` for values, whatever the data base calls them."""

    def __init__(self, cursor: Any, mark: str) -> None:
        self._cursor = cursor
        self._mark = mark

    def run(self, statement: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """Run a statement and give its rows."""
        self._cursor.execute(statement.replace("?", self._mark), tuple(values))
        return [] if self._cursor.description is None else [tuple(row) for row in self._cursor.fetchall()]


def is_url(where: str | Path) -> bool:
    """Whether a log lies in a PostgreSQL data base."""
    return str(where).startswith(("postgresql://", "postgres://"))


@contextmanager
def transaction(where: str | Path, *, writing: bool) -> Iterator[Transaction]:
    """Open a log for one transaction: all of it is kept, or nothing.

    A SQLite file is made when it is written to first; a log that is only read must exist.
    """
    with _postgresql(str(where)) if is_url(where) else _sqlite(Path(where), writing) as opened:
        yield opened


@contextmanager
def _sqlite(file: Path, writing: bool) -> Iterator[Transaction]:
    if not writing and not file.is_file():
        raise UsageError(f"{file} is not there; 'rotordrop log add' makes a log with its first drop")
    try:
        with closing(sqlite3.connect(file, timeout=WAIT, isolation_level=None)) as connection:
            _make_wal(connection)
            # FULL: what was added survives a power cut
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("PRAGMA foreign_keys = ON")
            opened = Transaction(connection.cursor(), "?")
            if writing:
                for table in TABLES:
                    opened.run(table.format(serial="INTEGER PRIMARY KEY", real="REAL"))
            opened.run("BEGIN IMMEDIATE" if writing else "BEGIN")
            try:
                yield opened
                connection.execute("COMMIT")
            except BaseException:
                if connection.in_transaction:
                    connection.execute("ROLLBACK")
                raise
    except sqlite3.IntegrityError:
        raise
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError):
            raise OutputError(f"{file}: the log cannot be used: {error}") from error
        raise UsageError(f"{file} is not a log of drops ({error}); name another file") from error


def _make_wal(connection: sqlite3.Connection) -> None:
    """Let readers go on while somebody writes.

    Making a new log so fails at once, whatever the timeout, while another one does the same or repairs what a
    killed writer left.
    """
    until = time.monotonic() + WAIT
    while True:
        try:
            if connection.execute("PRAGMA journal_mode").fetchone()[0] != "wal":
                connection.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            if "locked" not in str(error) or time.monotonic() > until:
                raise
        time.sleep(PAUSE)


@contextmanager
def _postgresql(url: str) -> Iterator[Transaction]:
    try:
        import psycopg
    except ImportError as error:
        raise UsageError(
            "a log in PostgreSQL needs the extra 'postgres'; install it with: "
            "pip install 'rotordrop[postgres]'"
        ) from error
    try:
        with psycopg.connect(url, connect_timeout=10) as connection, connection.cursor() as cursor:
            opened = Transaction(cursor, "%s")
            # Two who make the tables at once would clash inside PostgreSQL's catalogue
            opened.run("SELECT pg_advisory_xact_lock(7208)")
            for table in TABLES:
                opened.run(table.format(serial="SERIAL PRIMARY KEY", real="DOUBLE PRECISION"))
            yield opened
    except psycopg.OperationalError as error:
        raise OutputError(f"the log at {url.rpartition('@')[2]} cannot be used: {error}") from error
