"""Windows of the histories of a result: drawn from few points, or as a table of every sample."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse

from rotordrop.errors import UsageError
from rotordrop.web.desk import Desk, NotThereError, number, of_file
from rotordrop.web.workspace import labelled

if TYPE_CHECKING:
    from rotordrop.web.traces import Traces

CSV_ROWS = 20_000
"""Rows of a table that are made at once, before others get their turn; chosen, not measured."""


async def field(desk: Desk, request: Request) -> Response:
    """Amplitudes of one waterfall [m], frame after frame, in single precision."""
    from rotordrop.web.drawn import field_name

    folder = await desk.found(request)
    told = _page_of(folder)
    if "parts" not in told:
        raise NotThereError("this result has no waterfall")
    plane, part = number(request, "plane", 0), request.query_params.get("part", told["parts"][0])
    if plane not in range(len(told["planes"])) or part not in told["parts"]:
        raise UsageError(
            f"there is no waterfall of plane {plane:g}, part {labelled(part)!r}; there are planes 0 to "
            f"{len(told['planes']) - 1} and parts {', '.join(told['parts'])}"
        )
    place = folder / field_name(int(plane), part)
    return await of_file(place, "application/octet-stream")


async def window(desk: Desk, request: Request) -> Response:
    """Few samples that show a window of histories, in single precision."""
    folder = await desk.found(request)

    def shown() -> bytes:
        from rotordrop.web.traces import FEWEST_POINTS, MOST_POINTS, sent

        traces, rows, start, end = _asked_window(folder, request)
        points = int(number(request, "points", MOST_POINTS))
        if not FEWEST_POINTS <= points <= MOST_POINTS:
            raise UsageError(f"{points} points asked for; {FEWEST_POINTS} to {MOST_POINTS} are sent")
        return sent(traces, rows, traces.window(rows, start, end, points))

    return Response(await asyncio.to_thread(shown), media_type="application/octet-stream")


async def between(desk: Desk, request: Request) -> Response:
    """Mean, smallest and largest of histories between two instants, from every sample.

    A column ``"x 0|y 0"`` is the radius of two.
    """
    folder = await desk.found(request)

    def counted() -> list[dict[str, float | None]]:
        asked = [column.split("|")[:2] for column in request.query_params.getlist("column")]
        traces, _, start, end = _asked_window(folder, request, [name for pair in asked for name in pair])
        return [traces.between(traces.chosen(tuple(pair)), start, end) for pair in asked]

    return JSONResponse(await asyncio.to_thread(counted))


def _asked_window(
    folder: Path, request: Request, columns: Sequence[str] | None = None
) -> tuple[Traces, list[int], float, float]:
    from rotordrop.web.traces import open_traces

    told = _page_of(folder).get("traces")
    if told is None:
        raise NotThereError("this result has no histories")
    traces = open_traces(folder, told["name"], tuple(told["columns"]))
    rows = traces.chosen(tuple(request.query_params.getlist("column") if columns is None else columns))
    start, end = number(request, "start", told["start"]), number(request, "end", told["end"])
    if not start < end:
        raise UsageError(
            f"the window from {start:g} s to {end:g} s holds nothing; give an end after its start"
        )
    return traces, rows, start, end


@lru_cache(maxsize=64)
def _page_of(folder: Path) -> dict[str, Any]:
    """What the routes need of the content of a page."""
    found: dict[str, Any] = json.loads((folder / "page.json").read_text(encoding="utf-8"))
    return {key: found[key] for key in ("traces", "planes", "parts", "labels", "simulated") if key in found}


async def csv(desk: Desk, request: Request) -> Response:
    """Every sample of a window as a table, in SI units."""
    import numpy as np

    from rotordrop.estimate.histories import SIMULATED_COLUMN

    folder = await desk.found(request)
    traces, rows, start, end = await asyncio.to_thread(_asked_window, folder, request)
    page = _page_of(folder)
    labels, simulated = page.get("labels", {}), page.get("simulated")  # an earlier version wrote no labels
    first, last = np.searchsorted(traces.time, start), np.searchsorted(traces.time, end, side="right")

    async def table() -> AsyncIterator[str]:
        heads = ["time [s]", *(labels.get(traces.columns[row], traces.columns[row]) for row in rows)]
        yield ",".join([*heads, SIMULATED_COLUMN] if simulated else heads) + "\n"
        for begin in range(int(first), int(last), CSV_ROWS):
            stop = min(begin + CSV_ROWS, int(last))
            columns = [[repr(float(time)) for time in traces.time[begin:stop]]]
            columns += [[f"{value:.9g}" for value in traces.values[row, begin:stop].tolist()] for row in rows]
            if simulated:
                columns.append(["yes"] * (stop - begin))
            yield "".join(",".join(line) + "\n" for line in zip(*columns, strict=True))
            await asyncio.sleep(0)

    headers = {"content-disposition": 'attachment; filename="rotordrop.csv"'}
    return StreamingResponse(table(), media_type="text/csv; charset=utf-8", headers=headers)
