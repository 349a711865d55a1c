"""Shaft sections from a CSV table: by position or by length, with layers, and what is refused."""

import pytest

from rotordrop.errors import MachineFileError
from rotordrop.machine import loads_machine

BY_POSITION = """part;position [mm];outer diameter [mm];layer diameter [mm];layer density [kg/m^3]
# a remark
end;0;60;;
end;100;60;;
stack;200;80;100;7650
end;700;60;;
;800;;;
"""

BY_LENGTH = """Length [m],Elements,Outer diameter [mm],Inner diameter (mm),Part
0.2,2,60,,end
0.4,4,80,20,"core, hollow"
0.2,2,60,,end
"""


@pytest.fixture
def load(tmp_path, small_text):
    def loaded(table, extra=""):
        (tmp_path / "shaft.csv").write_text(table, encoding="utf-8")
        head, tail = small_text.index("[[rotor.sections]]"), small_text.index("[[touchdown_bearings]]")
        text = small_text[:head] + 'shaft_table = "shaft.csv"\n' + extra + small_text[tail:]
        return loads_machine(
            text.replace("node = 8", "node = 5").replace('position = "0.7 m"', "node = 5"), tmp_path
        )

    return loaded


def test_a_table_of_positions_gives_one_node_per_row(load):
    rotor = load(BY_POSITION).rotor
    assert rotor.node_positions == pytest.approx((0.0, 0.1, 0.2, 0.7, 0.8))
    assert [e.part for e in rotor.elements] == ["end", "end", "stack", "end"]
    assert rotor.elements[2].layer_diameter == pytest.approx(0.1)
    assert rotor.elements[2].layer_density == 7650.0
    assert rotor.elements[0].layer_diameter is None


def test_a_table_of_lengths_gives_sections(load):
    rotor = load(BY_LENGTH).rotor
    assert len(rotor.elements) == 8
    assert rotor.node_positions == pytest.approx([0.1 * k for k in range(9)])
    assert rotor.elements[3].inner_diameter == pytest.approx(0.02)
    assert rotor.elements[3].part == "core, hollow"


@pytest.mark.parametrize("separator", [";", ",", "\t"])
def test_any_usual_separator_will_do(load, separator):
    assert load(BY_POSITION.replace(";", separator)).rotor == load(BY_POSITION).rotor


@pytest.mark.parametrize(
    ("old", "new", "told", "line"),
    [
        (
            "outer diameter",
            "outer diametr",
            "unknown column 'outer_diametr'; did you mean 'outer_diameter'",
            1,
        ),
        (
            "position [mm]",
            "position",
            "the column 'position' has no unit; write for example 'position \\[mm\\]'",
            1,
        ),
        (
            "position [mm]",
            "inner diameter [mm]",
            "needs a column 'position \\[mm\\]' or 'length \\[mm\\]'",
            1,
        ),
        ("100;60", "100;60,5", "outer diameter: '60,5 mm' has a decimal comma; use 60.5", 4),
        ("100;60", "100;sixty", "outer diameter: 'sixty mm' does not begin with a number", 4),
        ("100;60", "100;", "the row has no outer diameter", 4),
        ("100;60", "100;0", "outer_diameter: 0 m is not allowed here; a length must be positive", 4),
        ("100;60", ";60", "the row has no position", 4),
        ("60;;\n;800;;;", "60;;\n;800;60;;", "the last row must hold the end of the shaft only", 7),
        ("end;100;60;;", "end;100;60;;;;", "the row has 7 columns, the heading 5", 4),
        ("700;60;;", "700;60;90;", "a layer needs both 'layer_diameter' and 'layer_density'", 6),
    ],
)
def test_a_refusal_names_the_line_of_the_table(load, old, new, told, line):
    assert old in BY_POSITION
    with pytest.raises(MachineFileError, match=told) as caught:
        load(BY_POSITION.replace(old, new, 1))
    assert caught.value.file.endswith("shaft.csv")
    assert caught.value.line == line


def test_positions_must_increase(load):
    with pytest.raises(MachineFileError, match="node 3 at 50 mm does not lie beyond node 2 at 100 mm"):
        load(BY_POSITION.replace("stack;200", "stack;50"))


def test_a_missing_table_is_named(load, tmp_path, small_text):
    text = small_text.replace("[rotor]", '[rotor]\nshaft_table = "nowhere.csv"', 1)
    head, tail = text.index("[[rotor.sections]]"), text.index("[[rotor.discs]]")
    with pytest.raises(MachineFileError, match=r"'nowhere\.csv': cannot read the shaft table: No such file"):
        loads_machine(text[:head] + text[tail:], tmp_path)


def test_the_shaft_is_given_once(load, small_text):
    with pytest.raises(
        MachineFileError, match="given by 'shaft_table' and by 'sections'; keep one"
    ) as caught:
        loads_machine(small_text.replace("[rotor]", '[rotor]\nshaft_table = "shaft.csv"', 1))
    assert (caught.value.line, caught.value.column) == (8, 15)


def test_an_empty_table_is_refused(load):
    with pytest.raises(MachineFileError, match="the shaft table holds no sections"):
        load("part;position [mm]\n")
