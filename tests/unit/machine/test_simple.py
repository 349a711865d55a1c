"""A machine of twelve numbers, and shaft tables as other programs call their columns."""

import math
from types import SimpleNamespace

import pytest
from tests.scaled_machines import TWELVE_NUMBERS

from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.machine import load_machine, loads_machine
from rotordrop.machine.ross_files import read_rotor
from rotordrop.machine.saving import machine_text
from rotordrop.machine.simple import SimpleMachine, simple_machine
from rotordrop.rotor.assembly import free_free_modes, rotor_fe
from rotordrop.rotor.machine_summary import summarise_machine
from rotordrop_bench.rotors import ROTORS


def test_mass_and_centre_of_mass_are_those_given_and_planes_are_nodes():
    machine = simple_machine(SimpleMachine(**TWELVE_NUMBERS))
    assert machine.rotor.mass == pytest.approx(60.0)
    assert machine.rotor.centre_of_gravity == pytest.approx(0.52)
    nodes = machine.rotor.node_positions
    assert [nodes[b.node - 1] for b in machine.touchdown_bearings] == pytest.approx([0.11, 0.98])
    assert [nodes[s.node - 1] for s in machine.sensors] == pytest.approx([0.18, 0.18, 0.9, 0.9])
    assert [math.degrees(s.angle.value) for s in machine.sensors[:2]] == pytest.approx([135.0, 45.0])
    assert machine.touchdown_bearings[0].air_gap.range == pytest.approx((0.25e-3 / 1.2, 0.3e-3), rel=1e-5)
    loads = [bearing.load for bearing in summarise_machine(machine).bearings]
    weight = 60.0 * 9.81
    assert loads == pytest.approx([weight * 0.46 / 0.87, weight * 0.41 / 0.87], rel=1e-6)


def test_its_bending_is_that_of_the_beam():
    """Uniform free-free beam, first bending (4.730)² √(EI/ρA)/(2π L²), less what shear takes."""
    guessed = simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"centre": "550 mm"})))
    machine = guessed.with_values({"rotor.stiffness_factor": 1.0, "rotor.mass_to_ends": 0.0})
    assert guessed.rotor.stiffness_factor.range == (0.16, 1.0)
    d = machine.rotor.elements[0].outer_diameter
    area = math.pi / 4 * d * d
    slender = 4.730041**2 / (2 * math.pi * 1.1**2) * math.sqrt(206e9 * math.pi / 64 * d**4 / (7850.0 * area))
    found = summarise_machine(machine).free_free[0]
    assert 0.96 * slender < found < slender


def test_the_file_reads_back_as_the_same_machine():
    machine = simple_machine(SimpleMachine(**TWELVE_NUMBERS))
    assert loads_machine(machine_text(machine)) == machine
    assert any("0.4 to 1.0 of a steel cylinder's" in note for note in machine.notes)


@pytest.mark.parametrize("rotor", ROTORS)
def test_the_ranges_of_the_beam_hold_the_rotors_at_hand(rotor):
    """Bending and inertia of every rotor of the bench over those of the cylinder of its mass and length."""
    described = ROTORS[rotor]().rotor
    numbers = {"mass": described.mass, "length": described.node_positions[-1]}
    beam = simple_machine(
        SimpleMachine(
            **(
                TWELVE_NUMBERS
                | numbers
                | {"centre": described.centre_of_gravity}
                | {
                    "bearings": (0.1 * numbers["length"], 0.9 * numbers["length"]),
                    "sensors": (0.2 * numbers["length"], 0.8 * numbers["length"]),
                }
            )
        )
    )
    cylinder = beam.with_values({"rotor.stiffness_factor": 1.0, "rotor.mass_to_ends": 0.0})
    true, plain = rotor_fe(described), rotor_fe(cylinder.rotor)
    softer = (free_free_modes(true, 3).frequency[2] / free_free_modes(plain, 3).frequency[2]) ** 2
    assert 0.16 <= softer <= 1.0
    assert 0.8 <= true.diametral_inertia / plain.diametral_inertia <= 1.5


def test_a_support_without_a_number_goes_with_the_size_of_the_rotor():
    small, large = (
        simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"mass": mass})))
        .touchdown_bearings[0]
        .support.stiffness
        for mass in ("7.5 kg", "60 kg")
    )
    assert float(large) == pytest.approx(2.0 * float(small), rel=1e-5)
    assert large.range == pytest.approx((2e8 / 7.0, 1.4e9), rel=1e-5)


def test_one_stiffness_for_both_ends_is_known_less_well_than_one_for_each():
    def ranges(support):
        machine = simple_machine(SimpleMachine(**(TWELVE_NUMBERS | {"support": support})))
        return [bearing.support.stiffness.range for bearing in machine.touchdown_bearings]

    assert ranges("1e8 N/m") == [pytest.approx((2e7, 5e8))] * 2
    assert ranges("8e7 N/m, 5e8 N/m") == [pytest.approx((4e7, 1.6e8)), pytest.approx((2.5e8, 1e9))]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"support": "1e8 N/m, 1e8 N/m, 1e8 N/m"}, r"has 3 values; give one, or one for each of 2 ends"),
        (
            {"bearings": ("980 mm", "110 mm")},
            r"bearings: 980 mm and 110 mm are no two planes of a rotor of 1\.10 m",
        ),
        ({"sensors": ("100 mm", "1.2 m")}, r"sensors: 100 mm and 1\.20 m are no two planes"),
        ({"centre": "900 mm"}, r"centre of mass at 900 mm is too far from the middle of a rotor of 1\.10 m"),
        ({"mass": 60}, None),
        ({"mass": "60"}, "'60' has no unit"),
        ({"support": "firm"}, "'firm' does not begin with a number"),
        ({"designation": "hello"}, "no bearing 'hello'"),
    ],
)
def test_numbers_that_do_not_fit_are_named(change, message):
    if message is None:
        assert simple_machine(SimpleMachine(**(TWELVE_NUMBERS | change))).rotor.mass == pytest.approx(60.0)
        return
    with pytest.raises(UsageError, match=message):
        simple_machine(SimpleMachine(**(TWELVE_NUMBERS | change)))


def test_the_command_takes_options_and_asks_for_the_rest(tmp_path, monkeypatch):
    asked = []

    def answer(question, **_):
        asked.append(question)
        return "soft"

    monkeypatch.setattr("typer.prompt", answer)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: True))
    said = {
        key: ", ".join(value) if isinstance(value, tuple) else value for key, value in TWELVE_NUMBERS.items()
    }
    options = [f"--{key.replace('_', '-')}={value}" for key, value in said.items() if key != "support"]
    target = tmp_path / "machine.toml"
    assert run(["init", "--simple", str(target), *options]) == 0
    assert len(asked) == 1
    assert "support of the touchdown bearings" in asked[0]
    assert load_machine(target).touchdown_bearings[0].support.stiffness.range == pytest.approx(
        (1e7 / 7.0, 7e7), rel=1e-5
    )


def test_numbers_without_simple_are_refused(capsys, tmp_path):
    assert run(["init", str(tmp_path / "m.toml"), "--mass", "60 kg"]) == 64
    assert "numbers of a machine belong to --simple" in capsys.readouterr().err


DYROBES = "Ele,L,OD,ID,Mass OD,Material\n,mm,mm,mm,mm,\n1,100,60,0,60,\n2,300,80,20,100,\n3,100,60,0,60,\n"


def test_a_table_as_programs_print_it(tmp_path):
    path = tmp_path / "shaft.csv"
    path.write_text(DYROBES, encoding="utf-8")
    rotor = read_rotor(path).rotor
    middle = rotor.elements[1]
    assert rotor.node_positions == pytest.approx((0.0, 0.1, 0.4, 0.5))
    assert (middle.outer_diameter, middle.inner_diameter, middle.layer_diameter) == pytest.approx(
        (0.08, 0.02, 0.1)
    )
    assert middle.layer_density == 7850.0
    assert rotor.elements[0].layer_diameter is None


def test_a_spreadsheet_is_the_same_table(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for line in DYROBES.splitlines():
        book.active.append([float(cell) if cell.isdigit() else cell or None for cell in line.split(",")])
    book.save(tmp_path / "shaft.xlsx")
    (tmp_path / "shaft.csv").write_text(DYROBES, encoding="utf-8")
    assert read_rotor(tmp_path / "shaft.xlsx").rotor == read_rotor(tmp_path / "shaft.csv").rotor
