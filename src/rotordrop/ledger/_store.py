"""Rows that are appended and never changed, in any data base that SQLAlchemy knows; SQLite by default.

Each row has a digest of itself and of the row before it, and the last one stands in a table of its own: what
was changed or is gone is named by its number.
"""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError, IntegrityError, ProgrammingError, SQLAlchemyError

from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError
from rotordrop.files import require_file, require_place

WAIT = 60.0
"""How long a writer waits for others [s]; chosen, not measured."""
TRIES = 100
"""Attempts to append a row beside others who append one; chosen, not measured."""
TABLES = sa.MetaData()
ROWS = sa.Table(
    "rotordrop_log",
    TABLES,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("kind", sa.String(16), nullable=False),
    sa.Column("content", sa.Text, nullable=False),  # JSON
    sa.Column("before", sa.String(64), nullable=False),
    sa.Column("digest", sa.String(64), nullable=False),
)
END = sa.Table(
    "rotordrop_log_end",
    TABLES,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("digest", sa.String(64), nullable=False),
)


@dataclass(frozen=True, kw_only=True)
class Rows:
    """What stands in a log."""

    whole: Mapping[int, tuple[str, str]]
    """Kind and content (JSON) by number."""
    wrong: Mapping[int, str]
    """What was changed or is gone, by number."""
    end: tuple[int, str]
    """Number and digest of the last row."""


def is_url(where: str | Path) -> bool:
    """Whether a log lies in a data base of a server."""
    return "://" in str(where)


def name_of(where: str | Path) -> str:
    """A log as messages name it: without user, password and settings."""
    return f"the log at {str(where).rpartition('@')[2].partition('?')[0]}" if is_url(where) else str(where)


def read_rows(where: str | Path) -> Rows:
    """Every row of a log, compared with its digests."""
    with _opened(where, writing=False) as connection:
        if not sa.inspect(connection).has_table(ROWS.name):
            raise UsageError(f"{name_of(where)} holds no log of drops; 'rotordrop log add' makes one")
        return _rows(connection)


def append(where: str | Path, made: Callable[[Rows], tuple[str, str]]) -> int:
    """Append a row and give its number; once this returns, it is kept. The first row makes the log.

    ``made`` gives kind and content of the row by what stands in the log, or refuses to.
    """
    for _ in range(TRIES):
        try:
            with _opened(where, writing=True) as connection:
                found = _rows(connection)
                number, before = found.end[0] + 1, found.end[1]
                kind, content = made(found)
                digest = _digest(number, kind, content, before)
                connection.execute(sa.insert(ROWS).values((number, kind, content, before, digest)))
                connection.execute(sa.delete(END))
                connection.execute(sa.insert(END).values((number, digest)))
            return number
        except IntegrityError:
            continue  # somebody else appended a row of this number
    raise OutputError(f"{name_of(where)}: others write to the log all the time; try again later")


def _rows(connection: sa.Connection) -> Rows:
    whole: dict[int, tuple[str, str]] = {}
    wrong: dict[int, str] = {}
    ends = connection.execute(sa.select(END)).all()
    last, expected = 0, ""
    for number, kind, content, before, digest in connection.execute(sa.select(ROWS).order_by(ROWS.c.number)):
        wrong |= dict.fromkeys(range(last + 1, number), "is gone")
        if digest == _digest(number, kind, content, before) and (last < number - 1 or before == expected):
            whole[number] = (kind, content)
        else:
            wrong[number] = "is not what was logged"
        last, expected = number, digest
    end = (ends[0].number, ends[0].digest) if ends else (0, "")
    if end != (last, expected):
        wrong |= dict.fromkeys(range(last + 1, end[0] + 1), "is gone") or {last: "is not what was logged"}
    return Rows(whole=whole, wrong=wrong, end=max(end, (last, expected)))


def _digest(*values: Any) -> str:
    return hashlib.sha256("\n".join(map(str, values)).encode(errors="backslashreplace")).hexdigest()


@contextmanager
def _opened(where: str | Path, *, writing: bool) -> Iterator[sa.Connection]:
    """A transaction: all of it is kept, or nothing. A log that is written is made where there is none."""
    if not isinstance(where, str | Path):
        raise UsageError(f"{where!r} is no place for a log; expected a path, or an address postgresql://…")
    try:
        engine = _of_server(str(where)) if is_url(where) else _of_file(Path(where), writing)
        if writing:
            try:
                TABLES.create_all(engine)
            except (IntegrityError, ProgrammingError):  # somebody else made them meanwhile
                TABLES.create_all(engine)
        with engine.begin() as connection:
            yield connection
    except (RotordropError, IntegrityError):
        raise
    except ImportError as error:
        raise UsageError(
            f"{name_of(where)} needs a driver ({error}); for PostgreSQL: pip install 'rotordrop[postgres]'"
        ) from error
    except (SQLAlchemyError, OSError, ValueError) as error:
        raise _refusal(name_of(where), error) from error


def _of_server(address: str) -> sa.Engine:
    url = sa.make_url(address)
    if url.drivername in ("postgresql", "postgres"):
        url = url.set(drivername="postgresql+psycopg")
    # both tables are read as they stood at one moment
    return sa.create_engine(url, poolclass=sa.NullPool, isolation_level="REPEATABLE READ")


def _of_file(file: Path, writing: bool) -> sa.Engine:
    if "\0" in str(file):
        raise UsageError(f"{str(file)!r} cannot be used: its name holds a NUL, where SQLite would end it")
    if file.exists() and not file.is_file():
        raise UsageError(f"{file} is no file; name another one for the log")
    for left in ("-journal", "-wal"):
        require_file(
            file.with_name(file.name + left), "remove it: no program leaves such a thing beside a log"
        )
    if writing:
        require_place(file)
    elif not file.exists():
        raise UsageError(f"{file} is not there; 'rotordrop log add' makes a log with its first drop")

    def connect() -> sqlite3.Connection:
        address = f"{file.absolute().as_uri()}?mode={'rwc' if writing else 'rw'}"
        made = sqlite3.connect(address, uri=True, timeout=WAIT, isolation_level=None)
        made.text_factory = lambda raw: raw.decode(errors="replace")  # its digest names a damaged row
        if writing:
            made.execute("PRAGMA synchronous = EXTRA")  # what was added survives a power cut
        return made

    engine = sa.create_engine("sqlite://", creator=connect, poolclass=sa.NullPool)
    begin = "BEGIN IMMEDIATE" if writing else "BEGIN"
    sa.event.listen(engine, "begin", lambda connection: connection.exec_driver_sql(begin))
    return engine


def _refusal(name: str, error: Exception) -> RotordropError:
    """What is said of a log that cannot be used."""
    own = error.orig if isinstance(error, DBAPIError) else error
    said = " ".join(str(own).split())
    if isinstance(own, sqlite3.Error) and "locked" in said:
        return OutputError(f"{name}: others have used the log for {WAIT:g} s; try again later")
    if type(own) is sqlite3.DatabaseError:
        kind = UsageError if "not a database" in said else DamagedFileError
        return kind(
            f"{name} is damaged or is not a log of drops ({said}): name another file, put back a copy of it, "
            "or begin another log and add the kept estimates to it"
        )
    return OutputError(f"{name} cannot be used: {said}")
