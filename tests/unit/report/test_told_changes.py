"""What changed since the last drop is told in the words of the tables."""

import copy

from rotordrop.estimate.changed import changes
from rotordrop.estimate.document import estimate_document, published_drop
from rotordrop.estimate.published import drop_of
from rotordrop.report.compare_page import told_changes


def test_a_wider_gap_before_is_named_in_words(estimate):
    document = copy.deepcopy(estimate_document(estimate))
    known = next(one["estimate"] for one in document["parameters"] if one["path"] == "NDE.air_gap")
    known["value"] -= 60e-6
    known["interval_90"] = [end - 60e-6 for end in known["interval_90"]]
    document["joint"] = None
    first, _ = told_changes(changes(drop_of(document, "before.json"), published_drop(estimate)))
    assert first.level == "warning" and "NDE: air gap (" in first.text
