"""The restart card stands in the report of its drop, with its answer and its assumptions."""

from __future__ import annotations

from rotordrop.estimate.document import published_drop
from rotordrop.estimate.estimate import Estimate
from rotordrop.report.estimate_page import assumed_card, estimate_page
from rotordrop.report.restart_page import RESTART, restart_page


def test_the_section_says_what_the_card_says(estimate: Estimate) -> None:
    card = assumed_card(estimate)
    section = next(part for part in estimate_page(estimate).sections if part.heading == RESTART)
    page = restart_page(card, published_drop(estimate))
    assert section.statements == page.verdict
    assert section.tables[:2] == page.summary
    assert any("state your own" in one.text for one in section.statements)
    assert [row[0] for row in section.tables[0].rows].count(f"{card.answer} ←") == 1


def test_a_card_with_an_earlier_drop_hangs_no_longer_on_its_prior_alone(estimate: Estimate) -> None:
    before = published_drop(estimate)
    alone, compared = assumed_card(estimate), assumed_card(estimate, before)
    assert alone.prior_alone and not compared.prior_alone
    section = next(
        part for part in estimate_page(estimate, card=compared).sections if part.heading == RESTART
    )
    assert section.statements[0].text == compared.statements[0]
