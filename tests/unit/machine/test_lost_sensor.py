"""A sensor without readings is left out; what remains must still show both directions in one plane."""

from __future__ import annotations

import pytest

from rotordrop.errors import MachineFileError
from rotordrop.evidence.quality import check_record
from rotordrop.evidence.quality.finding import stops
from rotordrop.machine import example_machine, example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import read_record


def without(names, folder, marked):
    """The example machine whose file marks sensors as lost, or leaves them out."""
    text = example_path("lp400").read_text()
    for name in names:
        head, _, rest = text.partition(f'name = "{name}"')
        if marked:
            text = f'{head}name = "{name}"\nlost = true{rest}'
        else:
            before, _, _ = head.rpartition("[[sensors]]")
            _, separator, after = rest.partition("[[sensors]]")
            text = before + separator + after
    return loads_machine(text, folder)


@pytest.mark.parametrize("marked", [True, False])
@pytest.mark.parametrize("name", ["S_NDE_A", "S_DE_B"])
def test_three_sensors_in_two_planes_are_read_and_pass_the_gate(name, marked):
    machine = without([name], example_path("lp400").parent, marked)
    assert name not in [sensor.name for sensor in machine.sensors]
    assert len(machine.sensors) == 3
    record = read_record(example_record_path("lp400_drop_060"), machine)
    assert record.signals.shape[1] == 3
    assert not stops(check_record(record, machine))
    assert loads_machine(machine_text(machine), example_path("lp400").parent) == machine


@pytest.mark.parametrize("marked", [True, False])
def test_one_sensor_per_plane_is_refused(marked):
    with pytest.raises(MachineFileError, match="the sensors resolve only 2 of the 4 rigid motions"):
        without(["S_NDE_A", "S_DE_B"], example_path("lp400").parent, marked)


def test_a_machine_without_any_working_sensor_is_refused_as_such():
    every = [sensor.name for sensor in example_machine("lp400").sensors]
    with pytest.raises(MachineFileError, match="the 0 sensors sit in 0 plane"):
        without(every, example_path("lp400").parent, True)
