"""A replayed estimate says what a tracked one says: simulated record, missing tail, doubtful power-off."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rotordrop.cli import estimate
from rotordrop.report.content import SIMULATED_RECORD


@pytest.fixture
def replayed(monkeypatch: pytest.MonkeyPatch) -> Any:
    instant = SimpleNamespace(notes=("power-off is doubtful",))
    drop = SimpleNamespace(drop_instant=instant, warnings=("noisy",))
    monkeypatch.setattr("rotordrop.estimation.replay.replay_drop", lambda *_, **__: drop)
    monkeypatch.setattr("rotordrop.estimation.replay.replay_document", lambda _: {"warnings": ["noisy"]})
    monkeypatch.setattr(
        "rotordrop.report.replay_page.replay_page", lambda *_, warnings, **__: tuple(warnings)
    )
    record: Any = SimpleNamespace(name="d", metadata={}, notes=("made by synthesize",), sha256="0")
    found: Any = [SimpleNamespace(message="noisy", severity="warning")]
    machine: Any = None
    documents, pages = estimate._replayed(machine, [record], [None], [found], None, None)
    return documents["d"], pages["d"]


def test_every_warning_is_said_once_in_document_and_page(replayed: Any) -> None:
    document, page = replayed
    assert document["warnings"] == list(page)
    assert document["warnings"].count("noisy") == 1
    assert "power-off is doubtful" in document["warnings"]
    assert any("no settled tail" in warning for warning in document["warnings"])


def test_a_simulated_record_is_called_simulated(replayed: Any) -> None:
    assert replayed[0]["simulated_record"] is True


def test_the_notice_fits_records_of_the_program_itself() -> None:
    assert "another program" not in SIMULATED_RECORD
