"""What is installed: floors in pyproject.toml, a lock file with hashes, without addresses, free licences."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
LOCKED = {
    name.lower().replace("_", "-") for name in re.findall(r"^([\w.-]+)(?:\[\w+\])?==", LOCK, re.MULTILINE)
}
COPYLEFT = {"mat73", "rota-order", "nevergrad", "sdypy"}
LESSER_COPYLEFT = {"nptdms", "asammdf", "psycopg"}


def _names(requirements):
    return {re.split(r"[\[<>=~! ;]", requirement)[0].lower() for requirement in requirements}


@pytest.mark.parametrize("requirement", SETTINGS["project"]["dependencies"])
def test_a_dependency_has_a_floor_and_no_pin(requirement):
    assert re.fullmatch(r"[A-Za-z0-9-]+>=[0-9.]+", requirement)


def test_the_lock_file_names_every_dependency():
    extras = SETTINGS["project"]["optional-dependencies"]
    wanted = _names(SETTINGS["project"]["dependencies"]).union(*map(_names, extras.values())) - {"rotordrop"}
    assert wanted <= LOCKED
    assert {"psycopg", "distributed"} <= wanted, "every extra counts"


def test_what_was_not_looked_up_is_not_called_free_of_vulnerabilities():
    path = ROOT / "tools" / "audit.py"
    audit = runpy.run_path(str(path))
    held = {"name": "old", "version": "1.0", "vulns": [{"id": "CVE-1", "fix_versions": ["1.1"]}]}
    absent = {"name": "new", "version": "9.0", "skip_reason": "not found"}
    assert audit["lines"]([held, absent], 3) == [
        "old 1.0: CVE-1, mended in 1.1",
        "1 of 3 locked versions looked up, 1 known vulnerabilities; 2 could not be looked up from here",
    ]
    assert audit["lines"]([], 2) == [
        "0 of 2 locked versions looked up, 0 known vulnerabilities; 2 could not be looked up from here"
    ]


def test_locked_packages_have_hashes_and_no_address_or_copyleft():
    blocks = re.split(r"\n(?=\S)", LOCK.split("\n", 1)[1].strip())
    assert len(blocks) >= len(LOCKED) > 30
    assert [block for block in blocks if "--hash=sha256:" not in block] == []
    assert re.search(r"://|--index|--extra-index|--find-links|--trusted-host", LOCK) is None
    extras = SETTINGS["project"]["optional-dependencies"]
    everything = LOCKED | {name for requirements in extras.values() for name in _names(requirements)}
    assert everything & COPYLEFT == set()
    assert _names(SETTINGS["project"]["dependencies"]) & LESSER_COPYLEFT == set()
