"""Windows of the histories of a result: drawn from few points, or as a table of every sample."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from rotordrop.errors import UsageError
from rotordrop.jobs.workspace import labelled
from rotordrop.web.desk import Desk, NotThereError

if TYPE_CHECKING:
    from rotordrop.jobs.traces import Traces

CSV_ROWS = 20_000
"""Rows of a table that are made at once; chosen, not measured."""


async def window(desk: Desk, request: Request) -> Response:
    """Few samples that show a window of histories, in single precision."""
    folder = await desk.found(request)

    def shown() -> bytes:
        from rotordrop.jobs.traces import MOST_POINTS, sent

        traces, rows, start, end = _asked_window(folder, request)
        points = min(max(int(_number(request, "points", MOST_POINTS)), 2), MOST_POINTS)
        return sent(traces, rows, traces.window(rows, start, end, points))

    return Response(await asyncio.to_thread(shown), media_type="application/octet-stream")


async def csv(desk: Desk, request: Request) -> Response:
    """Every sample of a window as a table, in SI units."""
    import numpy as np

    from rotordrop.estimate.histories import SIMULATED_COLUMN

    folder = await desk.found(request)
    traces, rows, start, end = await asyncio.to_thread(_asked_window, folder, request)
    page = _page_of(folder)
    first, last = np.searchsorted(traces.time, start), np.searchsorted(traces.time, end, side="right")

    def table() -> Iterator[str]:
        heads = ["time [s]", *(page["labels"][traces.columns[row]] for row in rows)]
        yield ",".join([*heads, SIMULATED_COLUMN] if page["simulated"] else heads) + "\n"
        for begin in range(int(first), int(last), CSV_ROWS):
            stop = min(begin + CSV_ROWS, int(last))
            columns = [[repr(float(time)) for time in traces.time[begin:stop]]]
            columns += [[f"{value:.9g}" for value in traces.values[row, begin:stop].tolist()] for row in rows]
            if page["simulated"]:
                columns.append(["yes"] * (stop - begin))
            yield "".join(",".join(line) + "\n" for line in zip(*columns, strict=True))

    headers = {"content-disposition": 'attachment; filename="rotordrop.csv"'}
    return StreamingResponse(table(), media_type="text/csv; charset=utf-8", headers=headers)


def _asked_window(folder: Path, request: Request) -> tuple[Traces, list[int], float, float]:
    from rotordrop.jobs.traces import open_traces

    told = _page_of(folder).get("traces")
    if told is None:
        raise NotThereError("this result has no histories")
    traces = open_traces(folder, told["name"], tuple(told["columns"]))
    rows = traces.chosen(tuple(request.query_params.getlist("column")))
    start, end = _number(request, "start", told["start"]), _number(request, "end", told["end"])
    if not start < end:
        raise UsageError(
            f"the window from {start:g} s to {end:g} s holds nothing; give an end after its start"
        )
    return traces, rows, start, end


def _number(request: Request, name: str, usual: float) -> float:
    """A number that follows an address, or its usual value."""
    text = request.query_params.get(name)
    try:
        value = float(usual if text is None else text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise UsageError(f"{name} is {labelled(str(text))!r}; expected a number")
    return value


@lru_cache(maxsize=64)
def _page_of(folder: Path) -> dict[str, Any]:
    """What the routes need of the content of a page."""
    file = folder / "page.json"
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return {key: found[key] for key in ("traces", "labels", "simulated") if key in found}
