"""Recordings the tests share: the bundled drop at 60 Hz and a short one at 150 Hz, both simulated."""

from dataclasses import replace
from pathlib import Path

import pytest

from rotordrop import example_machine, example_record_path, read_record

RECORDINGS = Path(__file__).parent / "recordings"


@pytest.fixture(scope="session")
def machine():
    return example_machine("lp400")


@pytest.fixture(scope="session")
def whole_drop(machine):
    return read_record(example_record_path("lp400_drop_060"), machine)


@pytest.fixture(scope="session")
def drop(whole_drop):
    """The drop at 60 Hz, 0.25 s before to 0.3 s after."""
    return whole_drop.window(-0.25, 0.3)


@pytest.fixture(scope="session")
def tail(machine):
    return read_record(example_record_path("lp400_drop_060_tail"), machine)


@pytest.fixture(scope="session")
def fast_drop(machine):
    return read_record(RECORDINGS / "drop_150_short.h5", machine)


@pytest.fixture(scope="session")
def edited():
    """Give a record whose signals were changed by a function."""

    def edit(record, change):
        signals = record.signals.copy()
        changed = change(signals)
        return replace(record, signals=signals if changed is None else changed)

    return edit
