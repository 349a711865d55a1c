"""Long computations called from Python show a bar in a terminal and in a notebook, and nothing elsewhere."""

import io
import re
import sys
from time import sleep
from types import SimpleNamespace

import pytest

from rotordrop.progress import shown, told_in_lines


@pytest.fixture
def error(monkeypatch):
    """Standard error, a terminal or not."""

    def made(*, terminal):
        stream = io.StringIO()
        stream.isatty = lambda: terminal
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setenv("TERM", "xterm")
        return stream

    return made


@pytest.mark.parametrize(
    ("terminal", "progress", "drawn"), [(True, None, True), (True, False, False), (False, None, False)]
)
def test_a_terminal_gets_a_bar_unless_it_is_not_wanted(error, terminal, progress, drawn):
    stream = error(terminal=terminal)
    with shown(progress, "estimating") as tell:
        tell("step 1", 0.25)
    assert ("step 1" in stream.getvalue() and "25 %" in stream.getvalue()) == drawn
    assert drawn or stream.getvalue() == ""


def test_notebooks_get_a_bar_and_who_gives_a_function_is_told(error, monkeypatch):
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    stream = error(terminal=False)
    with shown(None, "estimating") as tell:
        tell("step 1", 0.25)
    assert "step 1" in stream.getvalue()
    stream, told = error(terminal=True), []
    with shown(lambda *words: told.append(words), "estimating") as tell:
        tell("step 1", 0.25)
    assert told == [("step 1", 0.25)]
    assert stream.getvalue() == ""


def test_a_log_is_told_how_long_it_has_taken(error):
    stream = error(terminal=False)
    with told_in_lines("estimating", pause=0.01) as tell:
        tell("a step", 0.1)
        any(sleep(0.01) or stream.getvalue().count("a step") > 1 for _ in range(3000))  # a stage lasts
    assert re.search(r"(estimating: a step \(10 %\), \d+ s so far\n){2}", stream.getvalue())
