"""Serve a local page on this computer, and say what is installed on it."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from rotordrop._version import __version__
from rotordrop.cli import _options as options
from rotordrop.cli._options import text_option
from rotordrop.cli._output import console, deliver

if TYPE_CHECKING:
    from rich.console import Console

USUAL_PORT = 8737
"""Where the page is served; chosen, not measured."""

FIRST_RUN = "the first run takes half a minute more for a simulation, a minute for an estimate"
EXTRAS = {
    "io": "recordings of TDMS and Excel, shaft tables of Excel",
    "tables": "to_xarray(), to_dataframe(), Parquet",
    "postgres": "a log of drops in PostgreSQL",
    "cluster": "studies on a Dask cluster",
    "serve": "the page of 'rotordrop serve'",
}
"""What an extra is for."""


def serve(
    folder: Annotated[
        Path | None, text_option("FOLDER", "Where jobs are kept; your data folder by default.")
    ] = None,
    port: Annotated[
        int,
        Option("--port", min=0, max=65535, metavar="N", help="Where to listen; 0 takes a free port."),
    ] = USUAL_PORT,
) -> None:
    """Serve a local page: look at drops, estimate, read reports.

    Example: rotordrop serve
    """
    from rotordrop.web.server import data_folder
    from rotordrop.web.server import serve as serve_page

    place = folder or data_folder()

    def announce(address: str) -> None:
        out = console()
        out.print(f"The page is {address}\nJobs are kept in {place}. Ctrl-C ends the server.", soft_wrap=True)
        sys.stdout.flush()

    serve_page(place, port, announce, lambda words: console(sys.stderr).print(words))


def doctor(
    fingerprint: Annotated[
        bool,
        Option(
            "--fingerprint",
            help="Print only the hash of a short probe drop: equal where every drop has the same bits.",
        ),
    ] = False,
    json: options.Json = None,
) -> None:
    """Say what is installed, what is missing, and whether compiled code is cached.

    Example: rotordrop doctor
    """
    if fingerprint:
        from rotordrop.simulate.result import fingerprint as of_this_computer

        bits = of_this_computer()
        deliver({"fingerprint": bits}, json, lambda out: out.print(bits, no_wrap=True, crop=True))
        return
    found = examined()

    def summarise(out: Console) -> None:
        out.print(f"rotordrop {found['rotordrop']}, Python {found['python']}, {found['system']}")
        lost = [name for name, one in found["packages"].items() if one is None]
        for name in lost:
            out.print(f"problem: {name} is missing; install rotordrop again: pip install rotordrop")
        out.print(f"{len(found['packages']) - len(lost)} packages it needs are there.")
        for extra, one in found["extras"].items():
            without = ", ".join(name for name, number in one["packages"].items() if number is None)
            state = f"missing: {without}; pip install 'rotordrop[{extra}]'" if without else "installed"
            out.print(f"extra {extra} ({one['for']}): {state}")
        for line in cache_lines(found["cache"]):
            out.print(line)
        out.print(f"{found['cores']} cores; threads of linear algebra: {found['threads'] or 'as it likes'}")

    deliver(found, json, summarise)


def examined() -> dict[str, Any]:
    """Everything the command says, ready for JSON."""
    from rotordrop.physics._cached import compiled_code

    needs: dict[str, dict[str, str | None]] = {extra: {} for extra in ("", *EXTRAS)}
    for text in requires("rotordrop") or []:
        extra = re.search(r"extra == ['\"](\w+)", text)
        needs.setdefault(extra[1] if extra else "", {})[bare(text)] = _version(bare(text))
    return {
        "rotordrop": __version__,
        "python": platform.python_version(),
        "executable": sys.executable,
        "system": platform.platform(),
        "packages": needs[""],
        "extras": {extra: {"for": text, "packages": needs[extra]} for extra, text in EXTRAS.items()},
        "cache": compiled_code(),
        "cores": os.cpu_count() or 1,
        "threads": os.environ.get("OPENBLAS_NUM_THREADS"),
    }


def bare(requirement: str) -> str:
    """Name of a package that a requirement names."""
    return re.split(r"[^\w.-]", requirement, maxsplit=1)[0]


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def cache_lines(cache: dict[str, Any]) -> list[str]:
    """What to say of compiled code."""
    place, said = cache["folder"], []
    if cache["shipped"]:
        said.append(f"compiled code came with the package: {cache['shipped']} kernels")
    if cache["kernels"]:
        said.append(
            f"compiled code is cached: {cache['kernels']} kernels, {cache['bytes'] / 1e6:.1f} MB, in {place}"
        )
    if not said:
        said.append(f"compiled code is not cached yet in {place}; {FIRST_RUN}")
    if not (cache["writable"] or cache["shipped"]):
        said.append(
            f"problem: {place} cannot be written, every run compiles again; name another in NUMBA_CACHE_DIR"
        )
    return said
