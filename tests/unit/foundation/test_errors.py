"""Each error has an exit code of its own, and says where it happened."""

from __future__ import annotations

import pytest

from rotordrop import errors


def _all_errors() -> list[type[errors.RotordropError]]:
    return [
        value
        for value in vars(errors).values()
        if isinstance(value, type) and issubclass(value, errors.RotordropError)
    ]


def test_exit_codes_are_those_documented_and_all_different():
    codes = {error.__name__: error.exit_code for error in _all_errors()}
    assert codes == {
        "RotordropError": 1,
        "MachineFileError": 2,
        "RecordError": 3,
        "NoDropError": 3,
        "NothingFallsError": 3,
        "UnmatchedError": 3,
        "UnpairedError": 3,
        "UnsettledError": 3,
        "IdentificationError": 4,
        "SimulationError": 5,
        "OutputError": 6,
        "DamagedFileError": 6,
        "ConsistencyError": 7,
        "UsageError": 64,
    }


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ({"file": "m.toml", "line": 7, "column": 3}, "m.toml:7:3: node 99 does not exist"),
        ({"file": "m.toml"}, "m.toml: node 99 does not exist"),
        ({}, "node 99 does not exist"),
    ],
)
def test_machine_file_error_says_where(place, expected):
    error = errors.MachineFileError("node 99 does not exist", **place)
    assert str(error) == expected
    assert (error.line, error.column) == (place.get("line"), place.get("column"))
    assert error.message == "node 99 does not exist"


def test_a_usage_error_is_a_value_error_so_that_validators_pass_it_on():
    with pytest.raises(ValueError, match="not a kind"):
        raise errors.UsageError("'colour' is not a kind")
