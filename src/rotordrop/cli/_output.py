"""What the verbs write: summaries for people, JSON, pages, tables, progress on anything that takes time."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from rotordrop.errors import OutputError, UsageError
from rotordrop.files import digest_of_file, require_place, with_digest, write_json, write_text
from rotordrop.progress import Progress, is_shown, shown, told_in_lines

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.report.content import ReportContent
    from rotordrop.report.origin import Origin

STANDARD_OUTPUT = Path("-")
_PLAIN_WIDTH = 110
"""Columns of what is printed to a file or a pipe; chosen, not measured."""

OUTPUTS = ("json", "report", "output")
"""Parameters of the verbs that name files to write; other paths are read."""
FILLED = ("target", "folder")
"""Parameters that name a folder to fill, or a file that is never replaced unasked."""

_inputs: list[tuple[str, Path]] = []
_origin: list[Origin] = []


def console(stream: TextIO | None = None) -> Console:
    """Give a console that colours terminals only, and not even those when ``NO_COLOR`` is set."""
    from rich.console import Console

    target = stream or sys.stdout
    terminal = target.isatty()
    return Console(
        file=target,
        force_terminal=terminal,
        width=None if terminal else _PLAIN_WIDTH,
        highlight=False,
        soft_wrap=not terminal,
        emoji=False,
        markup=False,
    )


def deliver(
    content: Any,
    json_file: Path | None,
    summary: ReportContent | Sequence[ReportContent] | Callable[[Console], None],
    *,
    report: Path | None = None,
    drawn: ReportContent | None = None,
    written: Sequence[Path | None] = (),
    whole: bool = False,
) -> None:
    """Write page and JSON where they were asked for, and print the summary, what fits a screen or the whole.

    ``content`` is ready for JSON; a table gets a digest of its values. With ``-`` as its file it is printed
    in place of the summary: a page, several, or a function that prints on the console it is given. A report
    needs one page, drawn or as it is summarised. What was written before is named.
    """
    if report is not None:
        page = drawn or summary
        assert not callable(page) and not isinstance(page, Sequence)
        write_report(page, report)
    if json_file == STANDARD_OUTPUT:
        sealed = with_digest(content) if isinstance(content, dict) else content
        whole = (sys.stdout.encoding or "utf-8").lower().replace("-", "") == "utf8"
        sys.stdout.write(json.dumps(sealed, indent=2, ensure_ascii=not whole, allow_nan=False) + "\n")
        return
    if json_file is not None:
        write_json(json_file, content, sealed=isinstance(content, dict))
    out = console()
    if callable(summary):
        summary(out)
    else:
        from rotordrop.report.terminal import print_summary

        for page in summary if isinstance(summary, Sequence) else (summary,):
            print_summary(page, out, whole=whole)
    if files := [str(file) for file in (report, *written, json_file) if file is not None]:
        out.print(f"Written: {', '.join(files)}")


def write_report(content: ReportContent, file: Path, fingerprint: str = "") -> None:
    """Write a page with what it comes from: this command, its start, and the files as they were then."""
    from rotordrop.report.page import write_page

    write_page(content, file, replace(_origin[0], fingerprint=fingerprint))


def deliver_text(text: str, file: Path | None, *, overwrite: bool) -> None:
    """Print a text, or write it to a file that must not exist yet unless `overwrite` says so."""
    if file is None or file == STANDARD_OUTPUT:
        sys.stdout.write(text)
        return
    if file.exists() and not overwrite:
        raise OutputError(f"{file} exists already; name another file or add --force")
    write_text(file, text)
    console(sys.stderr).print(f"written: {file}")


def with_files_apart(verb: Callable[..., None]) -> Callable[..., None]:
    """Make a verb refuse to write over what it reads, and two outputs of one name, before it begins."""

    @wraps(verb)
    def called(**values: Any) -> None:
        _inputs[:] = [
            ("shaft table" if file is not path and path.suffix.lower() == ".toml" else name, file)
            for name, value in values.items()
            if name not in (*OUTPUTS, *FILLED)
            for path in (value if isinstance(value, list) else [value])
            if isinstance(path, Path)
            for file in (path, *_read_beside(path))
        ]
        require_places(*(values[name] for name in OUTPUTS if name in values))
        _origin[:] = [] if values.get("report") is None else [_origin_of(values.get("operator", ""))]
        verb(**values)

    return called


def _origin_of(operator: str) -> Origin:
    """Where a report of this command comes from; a file is for what its parameter says."""
    from rotordrop.report.origin import Origin, UsedFile, command_line

    def role(name: str, file: Path) -> str:
        if name in ("machine", "record", "records", "files"):  # in either order
            return "machine file" if file.suffix.lower() == ".toml" else "record"
        return name.removesuffix("s").replace("_", " ")

    files = (
        UsedFile(role=role(name, file), name=file.name, sha256=digest_of_file(file))
        for name, file in _inputs
        if file.is_file()
    )
    return Origin(command=command_line(sys.argv[1:]), files=tuple(files), operator=operator)


def _read_beside(file: Path) -> list[Path]:
    """Files that are read because another one names them: the shaft table of a machine, COMTRADE samples."""
    if file.suffix.lower() == ".cfg":
        return [file.with_suffix(suffix) for suffix in (".dat", ".DAT")]
    if file.suffix.lower() != ".toml" or not file.is_file():
        return []
    from rotordrop.document import parse_toml
    from rotordrop.elements.description import LARGEST_FILE

    try:
        with file.open(encoding="utf-8-sig") as stream:
            rotor = parse_toml(stream.read(LARGEST_FILE)).get("rotor")
        return [file.parent / str(rotor["shaft_table"])] if isinstance(rotor, dict) else []
    except (OSError, ValueError, KeyError):
        return []  # whoever reads the file says what is wrong with it


def require_places(*files: Path | None) -> None:
    """Refuse outputs that cannot be written, or would replace an input or another output, before any work."""
    read = {_identity(file) for _, file in _inputs}
    places: dict[object, Path] = {}
    for file in files:
        if file is None or file == STANDARD_OUTPUT:
            continue
        require_place(file)
        if file.exists() and not file.is_file():
            continue  # a device or a pipe takes more than one
        place = _identity(file)
        if place in read:
            raise UsageError(f"{file} is read by this command and would be replaced; name another file")
        if place in places:
            raise UsageError(f"{places[place]} and {file} are one file; give each output its own")
        places[place] = file


def _identity(file: Path) -> object:
    """What two names of one file have in common, also where it does not exist yet."""
    try:
        found = file.stat()
        return found.st_dev, found.st_ino
    except (OSError, ValueError):
        with suppress(FileNotFoundError):  # the folder one is in has been deleted
            return os.path.normcase(os.path.realpath(file))
        return str(file)


def places_beside(named: Path | None, records: Iterable[Path]) -> list[Path]:
    """The file or folder named, or one for each of several records."""
    stems = [record.stem for record in records]
    if named is None or len(stems) == 1:
        return [] if named is None else [named]
    return [named.with_name(f"{named.stem}_{stem}{named.suffix}") for stem in stems]


def progress_bar(title: str) -> AbstractContextManager[Progress]:
    """Show a long computation on standard error: a bar, or lines where that is no terminal."""
    return shown(None, title) if is_shown() else told_in_lines(title)
