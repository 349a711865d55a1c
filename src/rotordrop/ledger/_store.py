"""Where a log of drops is kept: a SQLite file, or a PostgreSQL data base by URL.

Beside the tables of version 1 stands one of seals: the version, and a digest for every drop and every
allowance, so that what has changed, gone or come by another way is named.

A SQLite log has a rollback journal and no write-ahead log: of one that a killed program left, SQLite drops
without a word every page from the first on that fails its checksum, acknowledged drops with them.
"""

from __future__ import annotations

import os
import sqlite3
import struct
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError
from rotordrop.files import require_file, require_place

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
        self.sealed = False
        """Whether the log had digests when it was opened."""

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
        missing = {"drops", "severity", "allowances"} - there
        if missing and there & {"drops", "severity", "allowances", "seals"}:
            raise DamagedFileError(
                f"{where} is damaged: its {' and '.join(sorted(missing))} are gone; take a copy of it"
            )
        self.sealed = "seals" in there
        if self.sealed:
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
    if not isinstance(where, str | Path):
        raise UsageError(f"{where!r} is no place for a log; expected a path, or an address postgresql://…")
    try:
        with _postgresql(str(where), writing) if is_url(where) else _sqlite(Path(where), writing) as opened:
            yield opened
    except RotordropError:
        raise
    except ValueError as error:  # signs that no data base takes
        raise UsageError(f"{name_of(where)!r} cannot be used: {error}") from error


@contextmanager
def _sqlite(file: Path, writing: bool) -> Iterator[Transaction]:
    try:
        with closing(_connected(file, writing)) as connection:
            opened = Transaction(connection.cursor(), "?")
            if writing:
                leave_wal(connection)
                # EXTRA: what was added survives a power cut
                connection.execute("PRAGMA synchronous = EXTRA")
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
        left = [one.name for one in _left_by_killed(file) if one.exists()]
        why = f"the log cannot be used: {error}"
        if "locked" in str(error):
            why = f"others have used the log for {WAIT:g} s; try again later"
        elif left and not writing:
            why = (
                f"a program was killed while it wrote to the log. What it left, {' and '.join(left)}, is put "
                f"right where file and folder may be written: copy both files to a folder of your own, and "
                f"read the log there ({error})"
            )
        raise OutputError(f"{file}: {why}") from error
    except sqlite3.DatabaseError as error:
        if "malformed" in str(error):
            raise DamagedFileError(
                f"{file} is damaged ({error}): put back a copy of it, or begin another log and add the kept "
                "estimates to it"
            ) from error
        raise UsageError(f"{file} is not a log of drops ({error}); name another file") from error
    except OSError as error:
        raise OutputError(f"{file}: the log cannot be used: {error.strerror}") from error


def _left_by_killed(file: Path) -> tuple[Path, Path]:
    """Where a killed program leaves its write-ahead log, if it is an older rotordrop, and its journal."""
    return file.with_name(f"{file.name}-wal"), file.with_name(f"{file.name}-journal")


def _connected(file: Path, writing: bool) -> sqlite3.Connection:
    """Open a file; one that asks for a write-ahead log where none can be made as one that nobody changes."""
    if "\0" in str(file):
        raise ValueError("its name holds a NUL, where SQLite would end it")
    if file.exists() and not file.is_file():
        raise UsageError(f"{file} is no file; name another one for the log")
    if not writing and not file.exists():
        raise UsageError(f"{file} is not there; 'rotordrop log add' makes a log with its first drop")
    if writing:
        require_place(file)
        if file.exists() and not os.access(file, os.W_OK):
            raise OutputError(
                f"{file} may only be read; copy it to where you may write, or ask for the right"
            )
    wal, journal = _left_by_killed(file)
    for left in (wal, journal):
        require_file(left, "remove it: no program leaves such a thing beside a log")
    if wal.is_file() and not _is_whole(wal.read_bytes()):
        raise DamagedFileError(
            f"{wal} is damaged, and with it the drops that a program added last before it was killed. Take a "
            f"copy of it and of {file.name}; to go on with what is whole: sqlite3 LOG 'PRAGMA journal_mode = "
            "DELETE'. Then compare the drops with your estimates, and add what is missing"
        )
    mode = "mode=rwc" if writing else "mode=rw"
    if not writing and not os.access(file.parent, os.W_OK) and not wal.exists():
        with file.open("rb") as stream:
            if stream.read(20)[18:] == b"\2\2":
                mode = "immutable=1"
    return sqlite3.connect(f"{file.absolute().as_uri()}?{mode}", uri=True, timeout=WAIT, isolation_level=None)


def leave_wal(connection: sqlite3.Connection) -> None:
    """Give a log of an older rotordrop a rollback journal; SQLite waits for nobody here by itself."""
    until = time.monotonic() + WAIT
    while True:
        try:
            if connection.execute("PRAGMA journal_mode = DELETE").fetchone()[0] == "delete":
                return
        except sqlite3.OperationalError as error:
            if "locked" not in str(error):
                raise
        if time.monotonic() > until:
            raise sqlite3.OperationalError("database is locked")
        time.sleep(PAUSE)


def _is_whole(wal: bytes) -> bool:
    """Whether every page of a write-ahead log passes its checksum, but for one that was cut short.

    Source: the file format of SQLite, section 4. What stands there from before the log was begun anew differs
    in both of its salts.
    """
    if len(wal) < 32:
        return True
    order = ">" if wal[3] & 1 else "<"
    size = struct.unpack(">I", wal[8:12])[0]

    def summed(part: bytes, first: int, second: int) -> tuple[int, int]:
        for one, other in struct.iter_unpack(f"{order}2I", part):
            first = (first + one + second) & 0xFFFFFFFF
            second = (second + other + first) & 0xFFFFFFFF
        return first, second

    sums = summed(wal[:24], 0, 0)
    if sums != struct.unpack(">2I", wal[24:32]):
        return False
    for at in range(32, len(wal) - size - 23, size + 24):
        head = wal[at : at + 24]
        sums = summed(wal[at + 24 : at + 24 + size], *summed(head[:8], *sums))
        if head[8:16] != wal[16:24] or sums != struct.unpack(">2I", head[16:]):
            return head[8:12] != wal[16:20] and head[12:16] != wal[20:24]
    return True


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
