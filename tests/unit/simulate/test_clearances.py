"""How much of a clearance a drop uses: against the motion itself, on the page, in JSON and in a study."""

import numpy as np
import pytest

from rotordrop.estimate.simulated_drop import simulation_numbers
from rotordrop.machine import loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.simulate.used import clearance_uses
from rotordrop.study.quantities import columns_of, row_of


@pytest.fixture(scope="module")
def sealed(paper, drop):
    """The reference machine with a wide place, and one as narrow as the drop travels at the NDE."""
    node = paper.touchdown_bearings[0].node
    reached = float(np.max(np.linalg.norm(drop.displacement[:, 0], axis=-1)))
    text = machine_text(paper) + (
        f'\n[[clearances]]\nname = "wide"\nnode = {node + 4}\ngap = "2 mm"\n'
        f'\n[[clearances]]\nname = "NDE_seal"\nnode = {node}\ngap = "{0.999 * reached!r} m"\n'
    )
    return loads_machine(text)


def test_use_is_the_largest_travel_at_the_node_and_none_without_clearances(sealed, drop, paper):
    wide, seal = clearance_uses(sealed, drop)
    radius = np.linalg.norm(drop.displacement[:, 0], axis=-1)
    assert seal.travel == pytest.approx(radius.max(), rel=1e-12)
    assert seal.time == drop.time[np.argmax(radius)]
    assert seal.share == pytest.approx(1.0 / 0.999, rel=1e-9)
    moved = drop.at_nodes([wide.node])[:, 0]
    assert wide.share == pytest.approx(np.max(np.linalg.norm(moved, axis=-1)) / 2e-3, rel=1e-12)
    assert clearance_uses(paper, drop) == ()
    assert "clearances" not in simulation_numbers(drop, paper)
    assert not any("travel_over_gap" in column.name for column in columns_of(paper))


def test_the_document_says_who_touches(sealed, drop):
    entry = simulation_numbers(drop, sealed)["clearances"]["NDE_seal"]
    assert entry["travel_over_gap"] == pytest.approx(entry["largest_travel_m"] / entry["gap_m"], rel=1e-12)
    assert entry["travel_over_gap"] > 1.0


def test_a_study_keeps_the_share_of_every_clearance_and_varies_a_gap_by_its_name(sealed, quick, drop):
    names = [column.name for column in columns_of(sealed)]
    row = row_of(quick.with_machine(sealed), drop)
    assert len(row) == len(names)
    assert row[names.index("NDE_seal.travel_over_gap")] == pytest.approx(1.0 / 0.999, rel=1e-9)
    assert {q.name: q.unit for q in columns_of(sealed)}["wide.travel_over_gap"] == "1"
    wider = sealed.with_values({"clearances.wide.gap": "3 mm"})
    assert float(wider.clearances[0].gap) == pytest.approx(3e-3)
    assert loads_machine(machine_text(wider)) == wider
