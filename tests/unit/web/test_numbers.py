"""The form of twelve numbers: its schema, the machine it makes, and what it refuses."""

import json

import pytest

from rotordrop.machine import load_machine
from rotordrop.machine.simple import EXAMPLES, SimpleMachine, simple_machine, simple_schema

EXAMPLE = {name: text for name, text in EXAMPLES.items() if name != "preload"}


def test_the_page_makes_the_machine_that_python_makes(served, tmp_path):
    told = served.ask("GET", "/api/numbers").told
    assert told == simple_schema()
    job = served.new_job({})
    sent = served.order(f"/api/jobs/{job}/numbers", EXAMPLE)
    assert sent.status == 201, sent.text
    stored = served.space.jobs_folder / job / "files" / "machine.toml"
    numbers = EXAMPLE | {name: tuple(EXAMPLE[name].split(", ")) for name in ("bearings", "sensors")}
    made = simple_machine(SimpleMachine(**numbers))
    assert load_machine(stored).model_dump() == made.model_dump()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mass": ""}, "of the twelve numbers mass are missing"),
        ({"mass": 60}, "mass is '60'; expected a text with a unit"),
        ({"weight": "60 kg"}, "there is no number 'weight'; there are mass"),
        ({"mass": "60"}, "60"),
        ({"gap": "x" * 300}, "does not begin with a number"),
        ({"bearings": "110 mm"}, "two planes"),
        ({"designation": "--help"}, "--help"),
    ],
)
def test_what_makes_no_machine_is_refused_in_words(served, change, words):
    job = served.new_job({})
    refused = served.order(f"/api/jobs/{job}/numbers", EXAMPLE | change)
    assert refused.status == 400
    assert words in refused.text
    assert "Traceback" not in refused.text
    assert json.loads(served.ask("GET", f"/api/jobs/{job}").body)["files"] == {}
