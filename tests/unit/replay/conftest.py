"""The first impacts of a recorded drop with a known truth."""

import pytest
from tests.unit.evidence.fall.conftest import contacts as contacts
from tests.unit.evidence.fall.conftest import drop as drop
from tests.unit.evidence.fall.conftest import evidence as evidence
from tests.unit.evidence.fall.conftest import model as model
from tests.unit.evidence.fall.conftest import truth as truth

from rotordrop.replay.first_impacts import first_impacts


@pytest.fixture(scope="session")
def problem(evidence, model):
    return first_impacts(evidence, model, until=0.045)
