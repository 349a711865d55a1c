"""The recordings that the tests of a record share."""

from tests.unit.record.conftest import drop as drop
from tests.unit.record.conftest import edited as edited
from tests.unit.record.conftest import fast_drop as fast_drop
from tests.unit.record.conftest import machine as machine
from tests.unit.record.conftest import tail as tail
from tests.unit.record.conftest import whole_drop as whole_drop
