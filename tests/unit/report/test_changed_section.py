"""What changed since the last drop stands in the report, in the words of its tables."""

import copy

from rotordrop.estimate.document import estimate_document, published_drop
from rotordrop.estimate.published import drop_of
from rotordrop.report.changed_section import HEADING, changed_section
from rotordrop.report.estimate_page import estimate_page
from rotordrop.report.machine_content import spoken_key


def test_without_an_earlier_estimate_there_is_no_section(estimate):
    assert HEADING not in [part.heading for part in estimate_page(estimate).sections]


def test_the_same_drop_twice_shows_no_change_and_names_no_path(estimate):
    found = changed_section(estimate, published_drop(estimate))
    assert "no parameter changed beyond chance" in found.statements[0].text
    names = [str(row[0]) for row in found.tables[0].rows]
    assert "NDE: air gap" in names
    assert not any("_" in name or "." in name for name in names)


def test_a_wider_gap_before_is_named_in_words(estimate):
    document = copy.deepcopy(estimate_document(estimate))
    known = next(one["estimate"] for one in document["parameters"] if one["path"] == "NDE.air_gap")
    known["value"] -= 60e-6
    known["interval_90"] = [end - 60e-6 for end in known["interval_90"]]
    document["joint"] = None
    (first, *_) = changed_section(estimate, drop_of(document, "before.json")).statements
    assert first.level == "warning" and "NDE: air gap (" in first.text


def test_another_machine_is_a_sentence(estimate):
    before = published_drop(estimate).model_copy(update={"machine": "another"})
    assert "only drops of one machine can" in changed_section(estimate, before).text[0]


def test_keys_of_the_machine_file_are_words():
    assert spoken_key("unbalance.0.amount") == "unbalance 1, amount"
    assert spoken_key("sensors.*.position_error") == "every one of sensors, position error"
    assert spoken_key("NDE.race.width") == "NDE, race, width"
