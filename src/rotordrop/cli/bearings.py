"""Search bearings by designation, however it is written.

Size, balls, contact angle, clearance and preload of what a designation means, and of the listed bearings of
its size.
"""

from __future__ import annotations

from typing import Annotated

import typer

from rotordrop.cli._options import JsonOption
from rotordrop.cli._output import deliver
from rotordrop.errors import UsageError


def bearings(
    designation: Annotated[
        str, typer.Argument(metavar="DESIGNATION", help='Such as 71914, "7016 ACD/HCP4A", "6016-2Z/C3".')
    ],
    json_file: JsonOption = None,
) -> None:
    """Search bearings by designation: size, angle, balls listed or inferred, clearance, preload."""
    from rotordrop.elements.catalog import find_bearing, search_bearings
    from rotordrop.report.bearing_content import bearing_content, bearing_json
    from rotordrop.report.terminal import print_summary

    try:
        find_bearing(designation)
    except LookupError as error:
        raise UsageError(str(error)) from None
    found = search_bearings(designation)
    content = bearing_content(designation, found)
    deliver([bearing_json(bearing) for bearing in found], json_file, lambda out: print_summary(content, out))
