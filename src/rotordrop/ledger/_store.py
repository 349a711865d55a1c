"""Where a log of drops is kept: a SQLite file, or a PostgreSQL data base by URL.

Beside the tables of version 1 stands one of seals: the version, and a digest for every drop and every
allowance, so that what has changed or gone is named. An older rotordrop goes on with the same log and leaves
the seals alone.
"""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError

WAIT = 60.0
"""How long a writer waits for others [s]; chosen, not measured."""
PAUSE = 0.02
"""Pause before a log that is being made is looked at again [s]; chosen, not measured."""
VERSION = 2
"""Of the tables; 1 had no seals."""

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
    "CREATE TABLE IF NOT EXISTS seals (sealed TEXT PRIMARY KEY, digest TEXT NOT NULL)",
)


class Transaction:
    """One transaction: statements with ``?`` for values, whatever the data base calls them."""

    def __init__(self, cursor: Any, mark: str) -> None:
        self._cursor = cursor
        self._mark = mark
        self.seals: dict[str, str] = {}
        """Digests by what they are of, as they stand in the log."""

    def run(self, statement: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """Run a statement and give its rows."""
        self._cursor.execute(statement.replace("?", self._mark), tuple(values))
        return [] if self._cursor.description is None else [tuple(row) for row in self._cursor.fetchall()]

    def refuse_damaged(self, where: str | Path) -> None:
        """Refuse a SQLite file whose indexes are not those of its rows: a drop may be counted twice there."""
        if self._mark == "?" and (found := self.run("PRAGMA integrity_check(1)")[0][0]) != "ok":
            raise DamagedFileError(
                f"{where} is damaged: {found}. Take a copy of it; 'rotordrop log show' names a drop that is "
                "damaged. Where none is, make its indexes anew: sqlite3 LOG REINDEX"
            )

    def seal(self, what: str, digest: str | None) -> None:
        """Keep the digest of a drop or an allowance, or forget it."""
        self.run("DELETE FROM seals WHERE sealed = ?", (what,))
        if digest is not None:
            self.run("INSERT INTO seals (sealed, digest) VALUES (?, ?)", (what, digest))

    def open(self, where: str, catalogue: str, serial: str, real: str, *, writing: bool) -> None:
        """Make the tables that are missing, where the log is written; read the seals."""
        there = {name for (name,) in self.run(catalogue)}
        if not writing and "drops" not in there:
            raise UsageError(f"{where} holds no log of drops; 'rotordrop log add' makes one")
        if "seals" in there:
            self.seals = dict(self.run("SELECT sealed, digest FROM seals"))
            version = self.seals.pop("version", "")
            if not (version.isascii() and version.isdigit()):
                raise DamagedFileError(f"{where} is damaged: it has no version; take a copy of it")
            if int(version) > VERSION:
                raise UsageError(
                    f"{where} was written by a later rotordrop: its tables have version {version}, and this "
                    f"one knows 1 to {VERSION}; use that rotordrop, or export a table with it"
                )
        elif writing:
            for table in TABLES:
                self.run(table.format(serial=serial, real=real))
            self.seal("version", str(VERSION))


def is_url(where: str | Path) -> bool:
    """Whether a log lies in a PostgreSQL data base."""
    return str(where).startswith(("postgresql://", "postgres://"))


def name_of(where: str | Path) -> str:
    """A log as messages name it: without user, password and settings."""
    return f"the log at {str(where).rpartition('@')[2].partition('?')[0]}" if is_url(where) else str(where)


@contextmanager
def transaction(where: str | Path, *, writing: bool) -> Iterator[Transaction]:
    """Open a log for one transaction: all of it is kept, or nothing.

    A SQLite file is made when it is written to first; a log that is only read must exist.
    """
    try:
        with _postgresql(str(where), writing) if is_url(where) else _sqlite(Path(where), writing) as opened:
            yield opened
    except RotordropError:
        raise
    except ValueError as error:  # signs that no data base takes
        raise UsageError(f"{name_of(where)!r} cannot be used: {error}") from error


@contextmanager
def _sqlite(file: Path, writing: bool) -> Iterator[Transaction]:
    if "\0" in str(file):
        raise ValueError("its name holds a NUL, where SQLite would end it")
    if not writing and not file.is_file():
        raise UsageError(f"{file} is not there; 'rotordrop log add' makes a log with its first drop")
    try:
        with closing(_connected(file, writing)) as connection:
            opened = Transaction(connection.cursor(), "?")
            if writing:
                _make_wal(connection)
                # FULL: what was added survives a power cut
                connection.execute("PRAGMA synchronous = FULL")
                connection.execute("PRAGMA foreign_keys = ON")
            opened.run("BEGIN IMMEDIATE" if writing else "BEGIN")
            try:
                catalogue = "SELECT name FROM sqlite_master WHERE type = 'table'"
                opened.open(str(file), catalogue, "INTEGER PRIMARY KEY", "REAL", writing=writing)
                yield opened
                connection.execute("COMMIT")
            except BaseException:
                if connection.in_transaction:
                    connection.execute("ROLLBACK")
                raise
    except sqlite3.OperationalError as error:
        raise OutputError(f"{file}: the log cannot be used: {error}") from error
    except sqlite3.DatabaseError as error:
        raise UsageError(f"{file} is not a log of drops ({error}); name another file") from error


def _connected(file: Path, writing: bool) -> sqlite3.Connection:
    """Open a file; in a folder where SQLite cannot put its own files beside it as one that nobody changes."""
    mode = "mode=rwc" if writing else "mode=rw"
    waiting = file.with_name(f"{file.name}-wal")
    if not writing and not os.access(file.parent, os.W_OK) and not waiting.exists():
        mode = "immutable=1"
    return sqlite3.connect(f"{file.absolute().as_uri()}?{mode}", uri=True, timeout=WAIT, isolation_level=None)


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
def _postgresql(url: str, writing: bool) -> Iterator[Transaction]:
    try:
        import psycopg
    except ImportError as error:
        raise UsageError(
            "a log in PostgreSQL needs the extra 'postgres'; install it with: "
            "pip install 'rotordrop[postgres]'"
        ) from error
    try:
        with psycopg.connect(url, connect_timeout=10) as connection:
            connection.read_only = not writing
            with connection.cursor() as cursor:
                opened = Transaction(cursor, "%s")
                if writing:  # two who make the tables at once would clash inside PostgreSQL's catalogue
                    opened.run("SELECT pg_advisory_xact_lock(7208)")
                catalogue = "SELECT tablename FROM pg_tables WHERE schemaname = ANY (current_schemas(false))"
                serial, real = "SERIAL PRIMARY KEY", "DOUBLE PRECISION"
                opened.open(name_of(url), catalogue, serial, real, writing=writing)
                yield opened
    except psycopg.Error as error:
        raise OutputError(f"{name_of(url)} cannot be used: {error}") from error
