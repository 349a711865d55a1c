"""What changed since the last drop stands in the report, in the words of its tables."""

import copy

from rotordrop.estimate.document import estimate_document
from rotordrop.estimate.published import drop_of
from rotordrop.report.changed_section import changed_section


def test_a_wider_gap_before_is_named_in_words(estimate):
    document = copy.deepcopy(estimate_document(estimate))
    known = next(one["estimate"] for one in document["parameters"] if one["path"] == "NDE.air_gap")
    known["value"] -= 60e-6
    known["interval_90"] = [end - 60e-6 for end in known["interval_90"]]
    document["joint"] = None
    (first, *_) = changed_section(estimate, drop_of(document, "before.json")).statements
    assert first.level == "warning" and "NDE: air gap (" in first.text
