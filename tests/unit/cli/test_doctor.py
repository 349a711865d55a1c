"""What the doctor says of this computer, and of one on which something is missing."""

import json
import tomllib
from pathlib import Path

from rotordrop.cli import computer
from rotordrop.cli.app import run

ROOT = Path(__file__).parents[3]
MAKING = ("docs", "dev")


def test_it_names_what_is_installed(capsys):
    assert run(["doctor", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["packages"]["numpy"]
    assert all(found["packages"].values())
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {name: needs for name, needs in stated["optional-dependencies"].items() if name not in MAKING}
    told = {name: sorted(one["packages"]) for name, one in found["extras"].items()}
    assert told == {
        name: sorted(computer.bare(text).lower() for text in needs) for name, needs in extras.items()
    }


def test_requirements_lose_their_versions():
    texts = ("npTDMS>=1.9", "tree-sitter-toml>=0.7", "psycopg[binary]>=3.1")
    assert [*map(computer.bare, texts)] == ["npTDMS", "tree-sitter-toml", "psycopg"]
