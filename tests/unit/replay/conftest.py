"""The first impacts of a recorded drop with a known truth."""

from __future__ import annotations

import pytest
from tests.unit.evidence.fall.conftest import contacts as contacts
from tests.unit.evidence.fall.conftest import drop as drop
from tests.unit.evidence.fall.conftest import evidence as evidence
from tests.unit.evidence.fall.conftest import model as model
from tests.unit.evidence.fall.conftest import truth as truth

from rotordrop.evidence.evidence import Evidence
from rotordrop.replay.first_impacts import FirstImpacts, first_impacts
from rotordrop.rotor.parameters import DropModel


@pytest.fixture(scope="session")
def problem(evidence: Evidence, model: DropModel) -> FirstImpacts:
    return first_impacts(evidence, model, until=0.045)
