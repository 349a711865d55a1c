"""The corpus: draws from the prior, tables that come back, ranks, and limits that break when they should."""

import json
import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest

from rotordrop import build_drop_model, example_machine, read_record
from rotordrop.errors import UsageError
from rotordrop.examples import example_files
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop_bench.cli.app import run as command
from rotordrop_bench.corpus.cases import (
    KINDS,
    digest,
    drawn_from_prior,
    known_machine,
    listed,
    made,
    plan_digest,
)
from rotordrop_bench.corpus.compare import limits, paired
from rotordrop_bench.corpus.run import Version, run
from rotordrop_bench.corpus.table import Row, holds, quantities, rank, read_table, write_table
from rotordrop_bench.event import stream
from rotordrop_bench.faults import FAULTS, PLAIN, spoiled
from rotordrop_bench.rotors import ROTORS

GIVEN = {
    "force NDE": (-40, -150, 70),
    "stress NDE": (10, -20, 40),
    "gap NDE": (5, -80, 90),
    "friction NDE": (0, -9, 9),
}


def row(number, group="prior", **more):
    given = Row(
        case=f"{group}-{number:03d}",
        digest=f"{number:012x}",
        look_code=0,
        code=0,
        look_seconds=1.0,
        seconds=8.0,
        findings=("warning:short record",),
        facts={"gap NDE": (30, -200, 260)},
        estimates=GIVEN,
    )
    return replace(given, **more)


ROWS = [row(i) for i in range(150)]


def broken(rows):
    return {one.name for one in limits(list(zip(ROWS, rows, strict=True))) if not one.kept}


def test_every_rotor_and_every_kind_of_departure_has_its_cases():
    cases = list(listed())
    assert len({case.name for case in cases}) == len(cases) == 468
    spoiled = [case for case in cases if case.fault]
    assert {case.fault for case in spoiled} == {*FAULTS}
    assert [case.fault for case in spoiled[:8]] == [*list(FAULTS)[:PLAIN], next(iter(FAULTS))]
    assert {case.rotor for case in spoiled} == set(ROTORS)
    assert {case.rotor for case in cases if case.group == "prior"} == set(ROTORS)
    assert {kind for case in cases for kind, _ in case.departures} == set(KINDS)
    assert len(list(listed(short=True))) == 60


@pytest.mark.parametrize("fault", list(FAULTS)[PLAIN:])
def test_a_mistake_of_a_fixed_size_changes_record_or_machine_alike_each_time(fault):
    machine = example_machine("lp400")
    record = read_record(example_files("lp400")["drop_060.h5"], machine).window(-0.1, 0.6)
    (first, one), (second, two) = (spoiled(record, machine, fault, "one") for _ in range(2))

    def same(a, b):
        pairs = [(getattr(a, name), getattr(b, name)) for name in ("signals", "time", "speed_readings")]
        return all(np.array_equal(x, y, equal_nan=x is not None and y is not None) for x, y in pairs)

    assert same(first, second) and one == two
    assert same(first, record) == fault.startswith("file: ") == (one != machine)


def test_the_truth_is_as_far_from_the_file_as_the_prior_says():
    known = known_machine("140 kg", 3)
    unknowns = {one.path: one for one in all_unknowns(build_drop_model(known))}
    paths = ("NDE.support.stiffness", "DE.friction.dynamic", "NDE.contact.damping")
    drawn = [drawn_from_prior(known, stream(seed, "prior"))[0] for seed in range(60)]
    for path in paths:
        bearing, part, name = path.split(".")
        one = unknowns[path]
        logs = [math.log(float(getattr(getattr(true.bearing(bearing), part), name))) for true in drawn]
        scores = (np.array(logs) - one.mean) / one.sigma
        assert abs(np.mean(scores)) < 3.3 / math.sqrt(60)
        assert 0.7 < np.std(scores) < 1.3


def test_an_exponent_is_drawn_with_the_force_at_a_typical_depth_kept():
    known = known_machine("60 kg", 0)
    model = build_drop_model(known)
    true, _ = drawn_from_prior(known, stream(2, "prior"))
    again = known.with_values({"NDE.contact.exponent": float(true.bearing("NDE").contact.exponent)})
    assert float(again.bearing("NDE").contact.exponent) != float(known.bearing("NDE").contact.exponent)
    depth = known.bearing("NDE").contact.typical_depth(float(np.mean(model.load_shares)))
    contact = true.bearing("NDE").contact
    (one,) = (u for u in all_unknowns(model) if u.path == "NDE.contact.stiffness")
    force = float(contact.stiffness) * depth ** float(contact.exponent)
    described = depth ** float(known.bearing("NDE").contact.exponent)
    assert abs(math.log(force / described) - one.mean) < 5.0 * one.sigma


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ((0, -50, 90), 0.5),
        ((50, 0, 80), 0.05),
        ((-60, -90, 0), 0.95),
        ((30, 0, 80), 0.05),
        ((-1, -1, -1), 1.0),
    ],
)
def test_the_ends_of_an_interval_are_its_quantiles(said, expected):
    assert rank(said) == pytest.approx(expected, abs=1e-9)


def test_a_table_comes_back(tmp_path):
    rows = [
        row(0),
        row(1, code=None, seconds=None, estimates={}, findings=(), facts={}),
        row(2, "facts", code=3),
    ]
    write_table(rows, plan_digest(), tmp_path / "one.csv")
    assert read_table(str(tmp_path / "one.csv")) == (plan_digest(), rows)


def test_the_same_version_keeps_every_limit_and_half_an_interval_holds_less():
    assert broken(ROWS) == set()
    assert holds((45, -10, 100))
    assert not holds((45, -10, 100), 0.5)


@pytest.mark.parametrize(
    ("change", "count", "limit"),
    [
        ({"estimates": GIVEN | {"force NDE": (600, 450, 750)}}, 9, "not covered at 90 %, force"),
        ({"estimates": GIVEN | {"gap NDE": (7, -80, 90)}}, 150, "median error, gap"),
        ({"estimates": GIVEN | {"stress NDE": (10, -25, 45)}}, 150, "median half width, stress"),
        ({"estimates": GIVEN | {"stress NDE": (510, 450, 560)}}, 2, "silent"),
        ({"code": 4, "estimates": {}}, 3, "not answered"),
        ({"code": 7}, 5, "flagged of the right structure"),
        ({"findings": ("warning:late channel",)}, 2, "alarms on clean records"),
        ({"look_code": 3, "facts": {}}, 1, "records refused"),
        ({"facts": {"gap NDE": (300, 100, 500)}}, 8, "facts outside their old interval"),
    ],
)
def test_what_got_worse_breaks_its_limit(change, count, limit):
    worse = [row(i, **change) if i < count else row(i) for i in range(150)]
    assert limit in broken(worse)
    assert count == 1 or limit not in broken([row(0, **change), *ROWS[1:]])


@pytest.mark.parametrize(
    ("change", "limit"),
    [
        ({"code": 7}, "flagged of the right structure"),
        ({"findings": ("warning:late channel",)}, "alarms on clean records"),
    ],
)
def test_a_version_beyond_a_limit_does_not_raise_it_for_the_next(change, limit):
    same = [row(i, **change) if i < 15 else row(i) for i in range(150)]
    (found,) = (one for one in limits([(one, one) for one in same]) if one.name == limit)
    assert (found.before, found.after, found.kept) == (0.1, 0.1, False)


@pytest.mark.parametrize(("count", "code"), [(0, 0), (15, 7)])
def test_a_comparison_ends_with_7_where_a_limit_is_broken(tmp_path, count, code):
    tables = [str(tmp_path / name) for name in ("before.csv", "after.csv")]
    for table in tables:
        rows = [row(i, code=7) if i < count else row(i) for i in range(150)]
        write_table(rows, plan_digest(), Path(table))
    found = tmp_path / "found.json"
    assert command(["corpus", "compare", *tables, "--json", str(found)]) == code
    assert json.loads(found.read_text())["kept"] == (code == 0)


def test_a_fault_is_caught_by_what_the_clean_record_does_not_have():
    clean = row(0, "facts", findings=("note:hum",))
    found, missed = (row(0, "faults", findings=("note:hum", *more)) for more in (("stop:clipping",), ()))
    kept = {one.name: one.kept for one in limits([(clean, clean), (found, found)])}
    assert kept["faults not caught"]
    lost = {one.name: one.kept for one in limits([(clean, clean), (found, missed)])}
    assert not lost["faults not caught"]
    before = {one.name: one.kept for one in limits([(clean, clean), (missed, missed)])}
    assert not before["faults not caught"]


def test_ranks_of_right_intervals_are_even():
    errors = [100.0 * NormalDist().inv_cdf((i + 0.5) / 400) for i in range(400)]
    rows = [
        row(i, estimates={"force NDE": tuple(round(e + d) for d in (0, -164, 164))})
        for i, e in enumerate(errors)
    ]
    (found,) = quantities({"prior": rows})
    assert found.unevenness < 0.5
    assert set(found.ranks) <= {38, 39, 40, 41, 42}
    assert found.covered[0.9] == pytest.approx(0.9, abs=0.05)
    narrow = [
        row(i, estimates={"force NDE": tuple(round(e + d) for d in (0, -82, 82))})
        for i, e in enumerate(errors)
    ]
    assert quantities({"prior": narrow})[0].unevenness > 1.36


def test_a_run_goes_on_where_it_was_and_is_scored(tmp_path):
    case = next(listed(short=True))
    made(case, tmp_path)
    truth = json.loads((tmp_path / "truth" / f"{case.name}.json").read_text())
    force = truth["peak_force_N"]["NDE"]
    said = {
        "bearings": {"NDE": {"peak_force_N": {"value": 1.01 * force, "interval_90": [force, 1.02 * force]}}}
    }
    script = tmp_path / "bin" / "python"
    script.parent.mkdir()
    script.write_text(
        "#!/bin/sh\necho called >> "
        + str(tmp_path / "calls")
        + '\nwhile [ "$1" != --json ]; do shift; done\n'
        "cat > \"$2\" <<'END'\n" + json.dumps(said) + "\nEND\n"
    )
    script.chmod(0o755)
    version = Version.at(str(script), "canned")
    (first,) = run(version, [case], tmp_path)
    assert run(version, [case], tmp_path) == [first]
    assert (tmp_path / "calls").read_text().count("called") == 2
    assert first.estimates == {"force NDE": (100, 0, 200)}
    assert first.digest == digest(tmp_path / "drops" / case.name)


def test_a_faulty_record_is_that_of_its_clean_case_with_the_fault(tmp_path):
    every = {case.name: case for case in listed()}
    case = next(case for case in every.values() if case.fault == "inverted polarity")
    spoiled, clean = (
        np.loadtxt(made(one, tmp_path) / "record.csv", comments="#", delimiter=";", skiprows=5)
        for one in (case, every[case.clean])
    )
    assert np.array_equal(spoiled[:, 1], -clean[:, 1])
    assert np.array_equal(spoiled[:, 2:], clean[:, 2:])


def test_only_versions_and_tables_of_the_same_records_are_compared(tmp_path):
    with pytest.raises(UsageError, match="neither a Python nor a checkout"):
        Version.at(str(tmp_path))
    first = ("plan", ROWS)
    assert len(paired(first, ("plan", [replace(ROWS[0], digest="other"), *ROWS[1:]]))) == 149
    with pytest.raises(UsageError, match="different plans"):
        paired(first, ("another", ROWS))
