"""The terminal summary: plain text where colours are not wanted, and no control characters from names."""

import io
from dataclasses import replace

from rich.console import Console

from rotordrop.evidence.look import look
from rotordrop.examples import example_record_path
from rotordrop.report.content import Card, KeyFigure, ReportContent, Statement, Table
from rotordrop.report.look_page import look_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.terminal import print_summary, summary_console

ESCAPE = "\x1b"


def content(name="LP-400"):
    peak = Quantity(value=3333.0, kind="force", interval_90=(3180.0, 3490.0))
    stress = Quantity(value=1.805e9, kind="pressure")
    return ReportContent(
        title=f"Drop of {name}",
        simulated="This record is simulated.",
        verdict=(Statement(text="Clipping on channel A.", level="warning"),),
        cards=(
            Card(title="NDE", figures=(KeyFigure(label="Peak bearing force", value=peak),)),
            Card(title="DE", figures=(KeyFigure(label="Peak Hertz stress", value=stress),)),
        ),
        summary=(Table(columns=("air gap", "NDE"), rows=(("lower", Quantity(value=27e-5, kind="length")),)),),
    )


def printed(report):
    stream = io.StringIO()
    print_summary(report, summary_console(stream))
    return stream.getvalue()


def test_all_numbers_with_unit_and_interval_are_printed():
    text = printed(content())
    for number in ("3333 N", "(3180 to 3490 N)", "1805 MPa", "270.0 µm"):
        assert number in text


def test_a_screen_holds_17_lines_and_counts_what_it_leaves_out():
    many = replace(
        content(),
        verdict=tuple(Statement(f"{k} {'word ' * 50}", "warning" if k % 2 else "notice") for k in range(9)),
        summary=(Table(("row",), tuple((f"row {k}",) for k in range(40))),),
    )
    stream = io.StringIO()
    print_summary(many, Console(file=stream, width=100))
    lines = stream.getvalue().splitlines()
    assert len(lines) == 17
    warnings, others, rows = (sum(one in line for line in lines) for one in ("warning:", "note:", "row "))
    *_, counted = (line for line in lines if "with --report" in line)
    said = 9 - (warnings + others - 1), 4 - warnings, 40 - (rows - 1)  # the count and the head apart
    assert counted == "note: {} more ({} warnings) and {} rows more with --report.".format(*said)
    whole = io.StringIO()
    print_summary(many, Console(file=whole, width=100), whole=True)
    assert all(f"row {k}" in whole.getvalue() for k in range(40))


def test_what_forbids_to_go_on_is_told_whole_with_its_way_out():
    stop = Statement(f"{'word ' * 90}; give the right unit in a profile", "bad")
    many = replace(content(), verdict=(Statement("Released."), *content().verdict * 20, stop))
    assert "give the right unit in a profile." in " ".join(printed(many).split())


def test_there_is_no_ansi_when_the_output_is_not_a_terminal(monkeypatch):
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    assert ESCAPE not in printed(content())


def test_no_color_is_obeyed_on_a_terminal(monkeypatch):
    def colours(stream):
        console = Console(file=stream, force_terminal=True, color_system="standard", highlight=False)
        print_summary(content(), console)
        return [code for code in ("[33m", "[1;33m") if code in stream.getvalue()]

    monkeypatch.delenv("NO_COLOR", raising=False)
    assert colours(io.StringIO())
    monkeypatch.setenv("NO_COLOR", "1")
    assert not colours(io.StringIO())


def test_a_name_cannot_repaint_the_terminal_or_bring_markup():
    text = printed(content(f"{ESCAPE}[2Jgone{ESCAPE}]0;title\x07 [bold]x[/bold]"))
    assert ESCAPE not in text
    assert "\x07" not in text
    assert "[bold]x[/bold]" in text


def test_a_speed_that_the_record_contradicts_stands_before_the_numbers():
    seen = look(example_record_path("lp400_drop_060"), speed="3600 Hz")
    first, second, *_ = look_page(seen, drawn=False).verdict
    assert "(rpm taken for Hz)" in first.text
    assert second.text.startswith("Released at")
