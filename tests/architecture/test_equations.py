"""Every public function of the physics names its source and the unit of what it takes and gives."""

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


spec = importlib.util.spec_from_file_location("equation_index", ROOT / "docs" / "equation_index.py")
index = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(index)
EQUATIONS = index.equations()


@pytest.mark.parametrize(
    "equation", EQUATIONS, ids=lambda equation: f"{equation.module[18:]}.{equation.function}"
)
def test_a_public_function_of_the_physics_names_unit_and_source(equation):
    assert equation.source, f"{equation.module}:{equation.line}: no 'Source: ...' in the docstring"
    assert equation.has_unit, f"{equation.module}:{equation.line}: no '[unit]' in the docstring"
    assert equation.without_unit == ()
    assert equation.first_sentence[:1].isupper(), "the first line is a sentence for a technician"


def test_the_page_has_one_row_per_function():
    rows = [line for line in index.index_page().splitlines() if line.startswith("| ")]
    assert len(rows) == len(EQUATIONS) + 1


def test_a_parameter_without_unit_is_found(tmp_path):
    sections = "Force [N].\n\n    Parameters\n    ----------\n    K : float\n        Stiffness [N/m].\n"
    sections += "    x : float\n        Way.\n    flag : int\n        Kind.\n\n    Source: none.\n"
    (tmp_path / "law.py").write_text(f'def force():\n    """{sections}    """\n')
    (equation,) = index.equations(tmp_path)
    assert equation.without_unit == ("x : float",)


@pytest.mark.parametrize(
    ("docstring", "source", "has_unit"),
    [
        ("Force [N].\n\n    Source: Neisi 2020, eq. (8).", "Neisi 2020, eq. (8)", True),
        (
            "Force.\n\n    Source: eq. (8), turned\n    round. Not validated: all.",
            "eq. (8), turned round",
            False,
        ),
        ("Force [N], from eq. (8).", None, True),
        ("Force of an `array`[0]_.", None, False),
    ],
)
def test_the_reading_of_a_docstring(tmp_path, docstring, source, has_unit):
    (tmp_path / "law.py").write_text(f'def force():\n    """{docstring}\n    """\n')
    (equation,) = index.equations(tmp_path)
    assert (equation.source, equation.has_unit) == (source, has_unit)
