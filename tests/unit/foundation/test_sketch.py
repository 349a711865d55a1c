"""What a notebook shows: words, and curves that stand where their numbers say."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.published import bearing, published, value

import rotordrop as rd
from rotordrop.estimate.published import Impact
from rotordrop.sketch import HEIGHT, WIDTH, sketch

LP400, RECORD = rd.example_machine("lp400"), rd.example_record_path("lp400_drop_060")
HITS = [
    Impact.model_construct(peak_time_s=at, peak_force_N=value(force))
    for at, force in ((0.01, 3e3), (0.02, 1e3))
]
READ = bearing({"peak_force_N": value(3e3, 2e3, 4e3)}).model_copy(update={"impacts": HITS})
SHOWN = {
    "machine": (lambda: LP400, 3),
    "record": (lambda: rd.read_record(RECORD, LP400), 4),
    "look": (lambda: rd.look(RECORD), 2),
    "drop": (lambda: rd.simulate_drop(LP400, rd.DropCase(speed="60 Hz", duration="2 ms")), 2),
    "study": (lambda: rd.sweep(LP400, {"speed": ["60 Hz", "90 Hz"]}, duration="2 ms"), 2),
    "estimate that was read": (lambda: published(bearings={"NDE": READ}), 1),
    "critical speed map": (lambda: rd.critical_speed_map(LP400, [1e7, 1e8], count=3), 3),
}


def lines(html):
    figure = ElementTree.fromstring(html[html.index("<svg") :])
    return [
        np.array([[float(x) for x in point.split(",")] for point in one.get("points").split()])
        for one in figure.iter("polyline")
    ]


@pytest.mark.parametrize("kind", SHOWN)
def test_every_result_has_a_figure_beside_its_words(kind):
    make, count = SHOWN[kind]
    made = make()
    drawn = lines(made._repr_html_())
    assert len(drawn) == count
    assert np.ptp(np.concatenate(drawn), axis=0) == pytest.approx((WIDTH, HEIGHT), abs=0.2)
    assert len(repr(made)) < 250 and "array(" not in repr(made)


def test_a_curve_ends_where_its_largest_number_is():
    html = sketch("<b>", "t [s]", "y [mm]", {"<i>": ([0.0, 1.0, 2.0], [0.0, np.nan, 2e-3])}, 1e3)
    (drawn,) = lines(html)
    assert drawn[-1] - drawn[0] == pytest.approx((WIDTH, -HEIGHT))
    texts = re.findall(r">([^<>]+)</text>", html)
    assert {"0", "2", "t [s]", "y [mm]", "&lt;i&gt;"} == set(texts) and 'pre-wrap">&lt;b&gt;</pre>' in html
    assert sketch("nothing", "", "", {"y": ([0.0], [np.nan])}).endswith(">nothing</pre>")


def test_contacts_are_lines_from_zero():
    (drawn,) = lines(SHOWN["estimate that was read"][0]()._repr_html_())
    assert drawn[[0, 2, 3, 5], 1] == pytest.approx(np.max(drawn[:, 1])), "none runs from peak to peak"


def test_what_one_uses_is_listed():
    assert {"touchdown_bearings", "with_values", "rotor"} < set(dir(LP400))
    assert not {"parse_obj", "model_dump", "fill"} & set(dir(LP400))
    with pytest.raises(AttributeError) as lost:
        rd.critical_speeds  # noqa: B018
    assert lost.value.name == "critical_speeds" and lost.value.obj is rd


def test_what_has_no_figure_is_short_in_words_too():
    told = repr(rd.campbell_diagram(LP400, [0.0, 400.0, 900.0], count=3))
    assert told.startswith(
        "<CampbellDiagram, touchdown bearings: 3 lines from 0 to 143.2 Hz, critical speeds "
    )


def test_an_estimate_that_was_read_has_rows():
    (row,) = published(record="a.csv", bearings={"NDE": READ}).rows()
    assert (row["drop"], row["bearing"]) == ("a.csv", "NDE")
    assert [row[f"peak force [N]{end}"] for end in ("", " 5 %", " 95 %")] == [3e3, 2e3, 4e3]
    assert np.isnan(row["air gap [m]"])


def test_the_largest_peak_is_that_with_the_highest_upper_end():
    near, far, none = value(3e3, 2.9e3, 3.1e3), value(2.9e3, 2e3, 4e3), value(5e3)
    for peaks, largest in (((near, far), "DE"), ((far, near, none), "NDE"), ((value(1e3), none), "DE")):
        ends = zip(("NDE", "DE", "MID"), peaks, strict=False)
        drop = published(bearings={name: bearing({"peak_force_N": peak}) for name, peak in ends})
        assert drop.largest("peak_force_N")[0] == largest
