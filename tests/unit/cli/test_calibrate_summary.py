"""The table of a calibration shows every number in the unit of the report."""

from __future__ import annotations

import io
from types import SimpleNamespace
from typing import Any

from rich.console import Console

from rotordrop.cli.estimate import print_calibration
from rotordrop.known import Known


def test_a_calibrated_gap_and_stiffness_are_shown_in_display_units() -> None:
    result: Any = SimpleNamespace(
        values={
            "DE.air_gap": Known(value=281e-6, interval_90=(270e-6, 292e-6), unit="m"),
            "DE.support.stiffness": Known(value=2.5e7, interval_90=(2.0e7, 3.0e7), unit="N/m"),
        },
        confounded=(),
        checks={},
        sentence=lambda: "done",
    )
    out = Console(file=io.StringIO(), width=160)
    print_calibration(result, out)
    text = out.file.getvalue()  # type: ignore[attr-defined]
    assert "281 µm" in text
    assert "25.0 N/µm" in text
    assert "e-0" not in text
    assert "e+0" not in text
