"""Rotors of ROSS: read, written and read back; what has no counterpart is refused or told."""

import json
import math

import pytest

from rotordrop.cli.app import run
from rotordrop.errors import MachineFileError
from rotordrop.machine import example_machine, load_machine
from rotordrop.machine.ross_files import Spring, read_ross, read_rotor, write_ross
from rotordrop.rotor.assembly import modes_on_springs, rotor_fe
from rotordrop.rotor.imported import imported_json

STEEL = {"name": "Steel", "rho": 7810.0, "E": 211e9, "G_s": 81.2e9}


def shaft(n, L=0.25, od=0.05, material=STEEL, **more):
    sizes = {"idl": 0.0, "odl": od, "idr": 0.0, "odr": od}
    return {"n": n, "L": L, "material": material, "tag": f"Shaft Element {n}", **sizes, **more}


def disc(n):
    tag = f"Disk {n}"
    return {"n": n, "m": 32.58972765304033, "Id": 0.17808928257067666, "Ip": 0.32956362089137037, "tag": tag}


def published():
    """The rotor of the documentation of ROSS, `rotor_example`."""
    content = {"ross_version": "2.3.0", "parameters": {}}
    content |= {f"ShaftElement_{n}": shaft(n) for n in range(6)}
    content |= {f"DiskElement_{n}": disc(n) for n in (2, 4)}
    bearing = {"kxx": [1e6], "kyy": [0.8e6], "cxx": [0], "cyy": [0]}
    return content | {f"BearingElement_{n}": {"n": n, "tag": f"Bearing {n}", **bearing} for n in (0, 6)}


@pytest.fixture
def written(tmp_path):
    def write(content, name="rotor.json"):
        path = tmp_path / name
        path.write_text(json.dumps(content), encoding="utf-8")
        return path

    return write


def test_the_published_rotor_has_the_frequencies_that_ross_2_3_computes(written):
    imported = read_ross(written(published()))
    assert imported.source == "ROSS 2.3.0"
    assert imported.rotor.mass == pytest.approx(88.18180401658343, rel=1e-12)
    assert [spring.node for spring in imported.springs] == [1, 7]
    # ROSS 2.3.0, run_modal at standstill with 1e8 N/m in both directions of both bearings [Hz]
    found = modes_on_springs(rotor_fe(imported.rotor), {1: 1e8, 7: 1e8}, 5).frequency
    assert found == pytest.approx([19.634, 75.766, 250.759, 360.631, 651.153], rel=3e-5)


@pytest.mark.parametrize("suffix", [".json", ".toml"])
@pytest.mark.parametrize("name", ["paper", "lp400", "small"])
def test_a_rotor_goes_to_ross_and_back_without_loss(tmp_path, name, suffix):
    rotor = example_machine(name).rotor
    springs = (Spring(node=2, name="AMB", stiffness=(1e6, 2e6), damping=(10.0, 20.0)),)
    write_ross(rotor, tmp_path / f"back{suffix}", springs)
    back = read_rotor(tmp_path / f"back{suffix}")
    assert back.springs == springs
    assert back.rotor.node_positions == pytest.approx(rotor.node_positions, rel=1e-12)
    for one, other in zip(rotor.elements, back.rotor.elements, strict=True):
        for key in ("outer_diameter", "inner_diameter", "density", "youngs_modulus", "layer_density"):
            assert getattr(other, key) == pytest.approx(getattr(one, key), rel=1e-12)
        assert other.poisson_ratio == pytest.approx(one.poisson_ratio, rel=1e-12)
        assert (other.layer_diameter or 0.0) == pytest.approx(one.layer_diameter or 0.0, rel=1e-12)
    assert [d.mass.value for d in back.rotor.discs] == [d.mass.value for d in rotor.discs]
    assert back.rotor.mass == pytest.approx(rotor.mass, rel=1e-12)


def test_layers_and_cones_are_kept(written):
    soft = STEEL | {"name": "soft sleeve", "E": 7e3, "G_s": 2.7e3}
    sleeve = shaft(1, od=0.08, material=soft, tag="sleeve") | {"idl": 0.05, "idr": 0.05}
    rotor = read_ross(written(published() | {"ShaftElement_sleeve": sleeve})).rotor
    element = rotor.elements[1]
    assert (element.layer_diameter, element.layer_density) == pytest.approx((0.08, 7810.0))
    extra = 7810.0 * math.pi / 4 * (0.08**2 - 0.05**2) * 0.25
    assert rotor.mass == pytest.approx(88.18180401658343 + extra, rel=1e-12)
    cone = shaft(0) | {"odl": 0.04, "odr": 0.06}
    imported = read_ross(written(published() | {"ShaftElement_0": cone}))
    assert imported.springs[1].node == len(imported.rotor.node_positions) == 14
    volume = math.pi / 4 * 0.25 * (0.04**2 + 0.04 * 0.06 + 0.06**2) / 3
    whole = math.pi / 4 * 0.25 * 0.05**2
    assert imported.rotor.mass == pytest.approx(88.18180401658343 + 7810.0 * (volume - whole), rel=2e-4)


def supported():
    """The same rotor with a mass on a spring under one bearing, at the link node 7."""
    content = published()
    content["BearingElement_0"] = content["BearingElement_0"] | {"kxx": [1e7], "kyy": [1e7], "n_link": 7}
    content["BearingElement_6"] = content["BearingElement_6"] | {"kxx": [1e7], "kyy": [1e7]}
    content["DiskElement_2"], content["DiskElement_4"] = disc(1), disc(3)
    ground = {"n": 7, "tag": "ground", "kxx": [1e8], "cxx": [500.0]}
    return content | {
        "BearingElement_ground": ground,
        "PointMass_7": {"n": 7, "m": 12.0, "mx": 12.0, "my": 12.0, "tag": "housing"},
    }


def test_a_point_mass_at_a_link_node_is_the_mass_of_a_support(written, tmp_path):
    source = written(supported())
    imported = read_ross(source)
    found = imported_json(imported)
    assert found["mass_kg"] == pytest.approx(88.18180401658343, rel=1e-12)
    # ROSS 2.3.0, run_modal at standstill [Hz], less its torsion
    for axis in "xy":
        assert found[f"on_source_bearings_{axis}_Hz"][:3] == pytest.approx([20.315, 78.326, 185.27], rel=1e-4)
    assert run(["convert", str(source), "-o", str(tmp_path / "machine.toml")]) == 0
    nde, de = (bearing.support for bearing in load_machine(tmp_path / "machine.toml").touchdown_bearings)
    assert [float(x) for x in (nde.mass, nde.stiffness, nde.damping_horizontal)] == [12.0, 1e8, 500.0]
    assert de.stiffness.status == "guess"
    write_ross(imported.rotor, tmp_path / "back.toml", imported.springs)
    assert read_ross(tmp_path / "back.toml").springs == imported.springs


def test_magnets_stand_where_the_source_has_them(written, tmp_path):
    magnet = {"kxx": [1e6], "cxx": [1e3], "g0": 1e-3, "i0": 1.0}
    magnets = {f"MagneticBearingElement_{n}": {"n": n, "tag": f"AMB {n}", **magnet} for n in (1, 5)}
    assert run(["convert", str(written(published() | magnets)), "-o", str(tmp_path / "machine.toml")]) == 0
    machine = load_machine(tmp_path / "machine.toml")
    assert [amb.node for amb in machine.ambs] == [2, 6]
    assert [bearing.node for bearing in machine.touchdown_bearings] == [1, 7]


def _without(content, *keys):
    return {key: value for key, value in content.items() if key not in keys}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"parameters": {}}, "there is no ShaftElement in it"),
        (published() | {"ShaftElement_x": shaft(9)}, "do not follow each other from node 0 on"),
        (published() | {"DiskElement_x": {"n": 2, "m": 1.0}}, "no 'Id' in an element"),
        (
            published() | {"ShaftElement_x": shaft(1, od=0.08, material=STEEL | {"name": "Al", "E": 70e9})},
            "different materials lie around each other at node 1",
        ),
        (published() | {"ShaftElement_2": shaft(2, material="unobtainium")}, "'unobtainium' is only named"),
        (
            _without(published(), "ShaftElement_3") | {"CouplingElement_1": {"n": 3, "kt_x": 1.0}},
            "a CouplingElement joins two shafts between nodes 3 and 4",
        ),
        (_without(supported(), "PointMass_7"), "'Bearing 0' is linked to node 7, where one point mass"),
        (published() | {"DiskElement_x": disc(9)}, "DiskElement at node 9: the shaft has nodes 0 to 6"),
    ],
)
def test_what_is_no_rotor_is_refused(written, content, message):
    with pytest.raises(MachineFileError, match=message):
        read_ross(written(content))


def test_the_command_makes_a_machine_of_it_and_back(written, tmp_path):
    source, machine, back = written(published()), tmp_path / "machine.toml", tmp_path / "back.toml"
    assert run(["convert", str(source), "-o", str(machine)]) == 0
    assert [bearing.node for bearing in load_machine(machine).touchdown_bearings] == [1, 7]
    assert run(["convert", str(machine), "--to", "ross", "-o", str(back)]) == 0
    assert read_ross(back).rotor.mass == pytest.approx(88.18180401658343, rel=1e-12)


def test_coupled_coefficients_tables_by_speed_and_seals_go_there_and_back(written, tmp_path):
    table = {
        "frequency": [0.0, 100.0],
        "kxx": [1e6, 2e6],
        "kyy": [1e6, 3e6],
        "kxy": [1e5, 2e5],
        "kyx": [-1e5, -4e5],
    }
    seal = {"n": 3, "tag": "Seal 1", "kxx": [1e4], "kyx": [-2e3], "cxx": [50.0]}
    content = published() | {"BearingElement_0": {"n": 0, "tag": "Bearing 0", **table}, "SealElement_1": seal}
    imported = read_ross(written(content))
    bearing, told = (next(s for s in imported.springs if s.name == name) for name in ("Bearing 0", "Seal 1"))
    assert told.kind == "SealElement"
    assert told.stiffness_matrix == ((1e4, 0.0), (-2e3, 1e4))
    assert told.damping_matrix == ((50.0, 0.0), (0.0, 50.0))
    assert bearing.stiffness_matrix == ((1e6, 1e5), (-1e5, 1e6))  # as at the first speed of the table
    assert bearing.told["kyx"] == (-1e5, -4e5)
    assert imported.nodes == (1, 2, 3, 4, 5, 6, 7)
    write_ross(imported.rotor, tmp_path / "back.toml", imported.springs)
    assert read_ross(tmp_path / "back.toml").springs == imported.springs


def test_files_of_version_3_have_speeds_in_their_tables_and_damping_of_the_whole_rotor(written):
    table = {"n": 0, "tag": "Bearing 0", "speed": [0.0, 100.0], "kxx": [1e6, 2e6], "interpolation": "pchip"}
    content = published() | {"ross_version": "3.1.0", "BearingElement_0": table}
    content["parameters"] = {"default_damping_ratio": 0.0, "alpha": 8.05, "beta": 1e-5}
    imported = read_ross(written(content))
    assert imported.source == "ROSS 3.1.0"
    assert imported.notes == ("proportional damping of the rotor is left out",)
    assert imported.springs[0].told["kyy"] == (1e6, 2e6)


def test_names_of_materials_have_no_blanks_and_discs_of_one_name_are_several(tmp_path):
    """ROSS refuses blanks there; layers were written with one."""
    machine = example_machine("lp400")
    rotor = machine.rotor.changed(discs=tuple(one.changed(name="wheel") for one in machine.rotor.discs))
    write_ross(rotor, tmp_path / "rotor.json")
    content = json.loads((tmp_path / "rotor.json").read_text())
    shafts = [one for key, one in content.items() if key.startswith("ShaftElement")]
    assert any(key.endswith(" layer") for key in content)
    assert not any(" " in one["material"]["name"] for one in shafts)
    assert len(read_ross(tmp_path / "rotor.json").rotor.discs) == len(machine.rotor.discs) > 1


def test_what_nobody_gave_is_marked_in_the_file(tmp_path):
    source, target = tmp_path / "shaft.csv", tmp_path / "machine.toml"
    source.write_text("Ele, L, OD, ID\n, mm, mm, mm\n1, 100, 60, 0\n2, 300, 80, 20\n3, 100, 60, 0\n")
    assert run(["convert", str(source), "-o", str(target), "--gap", "0.3 mm"]) == 0
    lines = target.read_text(encoding="utf-8").splitlines()
    made_up = ("designation", "bore_radius", "nominal", "at_speed", "angle")
    for key, marked in (*((key, True) for key in made_up), ("air_gap", False)):
        found = [line for line in lines if line.startswith(f"{key} = ")]
        assert found and all(("made up" in line) == marked for line in found), key
    assert load_machine(target).touchdown_bearings[0].air_gap.value == pytest.approx(0.3e-3)
