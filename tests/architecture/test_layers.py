"""A package imports only from rows below its own; the check itself is shown to fail where it should."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    command = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    return subprocess.run(
        [sys.executable, "-c", command],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": f"{folder / 'src'}{os.pathsep}{folder / 'bench' / 'src'}"},
    )


def test_the_package_keeps_its_layers():
    done = check(ROOT)
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout


def test_every_package_has_its_place_in_the_layers():
    layers = _contract()["layers"]
    named = {name.strip(" ()") for row in layers for name in row.split("|")}
    present = {
        path.stem
        for path in (ROOT / "src" / "rotordrop").iterdir()
        if (path.is_dir() and (path / "__init__.py").exists())
        or (path.suffix == ".py" and path.stem[0] != "_")
    }
    assert present <= named


@pytest.mark.parametrize(
    ("where", "imports"),
    [
        ("physics", "simulate"),
        ("elements", "machine"),
        ("evidence", "spectrum"),
        ("estimate", "twin"),
        ("twin", "replay"),
        ("errors", "units"),
        ("simulate", "cli"),
    ],
)
def test_an_import_upward_or_sideways_is_found(tmp_path, where, imports):
    _skeleton(tmp_path)
    assert check(tmp_path).returncode == 0, "the skeleton itself must be in order"
    package = tmp_path / "src" / "rotordrop" / where
    file = package / "__init__.py" if package.is_dir() else package.with_suffix(".py")
    file.write_text(f"import rotordrop.{imports}\n")
    done = check(tmp_path)
    assert done.returncode != 0
    assert f"rotordrop.{where}" in done.stdout


def test_a_package_without_a_place_is_found(tmp_path):
    _skeleton(tmp_path)
    package = tmp_path / "src" / "rotordrop" / "utils"
    package.mkdir()
    (package / "__init__.py").write_text("")
    done = check(tmp_path)
    assert done.returncode != 0
    assert "utils" in done.stdout


def test_a_page_that_asks_for_balls_is_found(tmp_path):
    _skeleton(tmp_path)
    (tmp_path / "src" / "rotordrop" / "report" / "__init__.py").write_text(
        "import rotordrop.physics.ball_bearing\n"
    )
    done = check(tmp_path)
    assert done.returncode != 0
    assert "states its own numbers" in done.stdout


def test_numba_in_a_second_file_is_found(tmp_path):
    _skeleton(tmp_path)
    (tmp_path / "src" / "rotordrop" / "simulate" / "__init__.py").write_text("import numba\n")
    done = check(tmp_path)
    assert done.returncode != 0
    assert "rotordrop.simulate -> numba" in " ".join(done.stdout.split())


def _contract() -> dict[str, list[str]]:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contract: dict[str, list[str]] = settings["tool"]["importlinter"]["contracts"][0]
    return contract


def _skeleton(folder: Path) -> None:
    """Write an empty package with every layer, under the contracts of the real one."""
    (folder / "pyproject.toml").write_text(
        (ROOT / "pyproject.toml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    root = folder / "src" / "rotordrop"
    for name in (name.strip(" ()") for row in _contract()["layers"] for name in row.split("|")):
        (root / name).mkdir(parents=True)
        (root / name / "__init__.py").write_text("")
    (root / "__init__.py").write_text("")
    (root / "physics" / "_compile.py").write_text("import numba\n")
    bench = folder / "bench" / "src" / "rotordrop_bench"
    bench.mkdir(parents=True)
    (bench / "__init__.py").write_text("")
    for name in ("ball_bearing", "ball_bearing_response"):
        (root / "physics" / f"{name}.py").write_text("")


def test_toml_is_parsed_in_one_place():
    """`parse_toml` refuses what is nested without end; each reader by itself forgot it."""
    package = ROOT / "src" / "rotordrop"
    using = [path.name for path in package.rglob("*.py") if "tomllib.load" in path.read_text("utf-8")]
    assert using == ["document.py"]
