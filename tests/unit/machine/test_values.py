"""Values with units, guesses and estimates; the machines that ship say what their sources say."""

import math

import pytest

from rotordrop import Known, check_record, example_record_path, read_record
from rotordrop.elements.values import LEFT_OUT, Physical
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.evidence.quality.finding import stops
from rotordrop.machine import example_machine, example_path, load_machine, loads_machine
from rotordrop.machine.saving import machine_text

STIFFNESS = Physical("stiffness", above=0.0)
ANGLE = Physical("angle", least=0.0, most=math.pi)


@pytest.mark.parametrize(
    ("written", "known"),
    [
        ("100 kN/mm", {"status": "given"}),
        (
            {"guess": "1e8 N/m", "range": ["5e7 N/m", "2e8 N/m"], "source": "drawing"},
            {"status": "guess", "range": (5e7, 2e8), "source": "drawing"},
        ),
        (
            {"value": "1e8 N/m", "interval": ["9e7 N/m", "1.1e8 N/m"], "source": "drop 3"},
            {"status": "estimated", "interval_90": (9e7, 1.1e8), "source": "drop 3"},
        ),
        ({"value": "1e8 N/m", "standard_error": "2e6 N/m"}, {"status": "estimated", "standard_error": 2e6}),
        ({"value": "1e8 N/m", "source": "drawing"}, {"status": "given", "source": "drawing"}),
        (
            {"value": "1e8 N/m", "lower": "9e7 N/m", "upper": "2e8 N/m"},
            {"status": "estimated", "lower": 9e7, "upper": 2e8},
        ),
    ],
)
def test_what_is_written_is_known(written, known):
    assert STIFFNESS.read(written) == Known(value=1e8, unit="N/m", **known)


def test_numbers_come_back_exactly_zero_where_it_makes_sense():
    for value in (1.0000000000000002, 123456789.12345679, 3e-17, 1.0000000000000002e-19):
        assert STIFFNESS.read(f"{value!r} N/m").value == value
    assert [Physical("dimensionless").read(number).value for number in (0.15, 1)] == [0.15, 1.0]
    assert STIFFNESS.read(LEFT_OUT) is LEFT_OUT
    assert ANGLE.read("0 deg").value == 0.0
    with pytest.raises(UsageError, match=r"-5\.00° is not allowed here; it must not be negative"):
        ANGLE.read("-5 deg")
    with pytest.raises(UsageError, match=r"200° is not allowed here; at most 180°"):
        ANGLE.read("200 deg")
    assert Physical("quadratic_drag", least=0.0).read("1e-32 N m s^2").value == 1e-32
    with pytest.raises(UsageError, match="'1e-32 m' is no length that a machine has"):
        Physical("length", above=0.0).read("1e-32 m")


@pytest.mark.parametrize(
    ("written", "told"),
    [
        (1e8, r"100000000\.0 has no unit; a stiffness needs one, for example '1e8 N/m'"),
        ("1e8 N", "'1e8 N' is not a stiffness"),
        ("0 N/m", "0 N/m is not allowed here; a stiffness must be positive"),
        ({"guess": "1e8 N/m", "value": "1e8 N/m"}, "either 'guess' or 'value', and only one"),
        ({"range": ["1 N/m", "2 N/m"]}, "either 'guess' or 'value', and only one"),
        ({"guess": "1e8 N/m", "interval": ["1e7 N/m", "1e9 N/m"]}, "a guess has a range, not 'interval'"),
        ({"guess": "1e8 N/m", "standard_error": "1e7 N/m"}, "a guess has a range, not 'standard_error'"),
        ({"guess": "1e8 N/m", "range": "1e7 N/m"}, "range = '1e7 N/m' is not a pair"),
        ({"guess": "1e8 N/m", "range": ["2e8 N/m", "1e7 N/m"]}, "runs backwards"),
        ({"guess": "1e8 N/m", "range": ["2e8 N/m", "3e8 N/m"]}, "100 MN/m lies outside its own range, 200"),
        ({"value": "1e8 N/m", "sorce": "x"}, "'sorce' does not belong to a value"),
        ({"value": "1e8 N/m", "source": 3}, "source = 3 is not a text"),
        ({"value": "1e8 N/m", "status": "sure"}, "status = 'sure' is not known; it is one of given, guess"),
        (True, "True is not a stiffness"),
        (Known(value=math.inf), "is not a finite number"),
        (Known(value=math.nan), "is not a finite number"),
    ],
)
def test_refusals_name_the_value_and_the_way_out(written, told):
    with pytest.raises(UsageError, match=told):
        STIFFNESS.read(written)


@pytest.fixture(scope="module", params=["paper", "lp400"])
def machine(request):
    return example_machine(request.param)


def test_the_rotor_has_the_published_mass_and_shares(machine):
    assert machine.rotor.mass == pytest.approx(59.49996, abs=2e-6)
    left, right = (machine.rotor.node_positions[b.node - 1] for b in machine.touchdown_bearings)
    far = machine.rotor.mass * (machine.rotor.centre_of_gravity - left) / (right - left)
    assert far == pytest.approx(41.7, abs=0.05)
    assert machine.rotor.mass - far == pytest.approx(17.8, abs=0.05)


def test_the_recorded_machine_is_that_of_its_owner():
    friction = example_machine("lp400").touchdown_bearings[0].friction
    assert friction.dynamic.status == "guess"
    assert friction.dynamic.range == (0.05, 0.2)
    assert friction.static.range == pytest.approx((0.065, 0.26))
    sensors = example_machine("lp400").sensors
    assert [s.name for s in sensors] == ["S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B"]
    assert [s.node for s in sensors] == [5, 5, 25, 25]
    assert [round(math.degrees(float(s.angle))) for s in sensors] == [135, 45, 135, 45]
    assert {float(s.sensitivity) for s in sensors} == {8000.0}
    assert example_machine("paper").source_path == example_path("paper")
    assert load_machine(example_path("paper")) == example_machine("paper")
    with pytest.raises(UsageError, match="example machine is 'paber'; expected one of paper, lp400"):
        example_machine("paber")


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


ONE_A_PLANE, EVERY = ["S_NDE_A", "S_DE_B"], ["S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B"]
FEW = [
    (ONE_A_PLANE, True, "the sensors resolve only 2 of the 4 rigid motions"),
    (ONE_A_PLANE, False, "the sensors resolve only 2 of the 4 rigid motions"),
    (EVERY, True, "the 0 sensors sit in 0 plane"),
]


@pytest.mark.parametrize(("names", "marked", "told"), FEW)
def test_one_sensor_per_plane_or_none_that_works_is_refused(names, marked, told):
    with pytest.raises(MachineFileError, match=told):
        without(names, example_path("lp400").parent, marked)
