"""Processes for functions: copies of one that has imported what they need, or begun anew."""

import os
import resource
import signal
import sys
import time
from pathlib import Path

import pytest

from rotordrop import child
from rotordrop.child import Starter

forks = pytest.mark.skipif(not child.FORKS, reason="no forks here")

MODULE = """
import json, os, resource, sys, time
from pathlib import Path
from rotordrop.child import limit

BEGUN = os.getpid()

def said(file, wait=0.0):
    told = {"begun": BEGUN, "self": os.getpid(), "parent": os.getppid(), "group": os.getpgid(0)}
    told["memory"] = resource.getrlimit(resource.RLIMIT_DATA)[0]
    Path(f"{file}.part").write_text(json.dumps(told))
    os.rename(f"{file}.part", file)
    time.sleep(wait)

def limited(file):
    limit(2**29, 10)
    said(file)

def failing(file):
    said(file)
    raise OSError("disk")
"""


@pytest.fixture
def told(tmp_path, monkeypatch):
    """Start a function of a module and give what it said, and whether it still holds what it was given."""
    (tmp_path / "functions_of_test.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    starter = Starter()

    def call(function, name, *arguments):
        import json

        file = tmp_path / name
        reads, held = os.pipe()
        starter.start(
            *("functions_of_test", function, str(file), *arguments), imports=("functions_of_test",), held=held
        )
        os.close(held)
        until = time.monotonic() + 600.0
        while not file.exists():
            assert time.monotonic() < until
            time.sleep(0.01)
        return json.loads(file.read_text()), reads

    call.starter = starter
    return call


def ended(reads):
    """Wait until nobody holds the other end."""
    assert os.read(reads, 1) == b""
    os.close(reads)


@pytest.mark.skipif(os.name != "posix", reason="descriptors are held on POSIX systems")
@pytest.mark.parametrize("copied", [pytest.param(True, marks=forks), False])
def test_a_function_has_a_process_and_a_group_of_its_own(told, monkeypatch, copied):
    monkeypatch.setattr(child, "FORKS", copied)
    one, reads = told("said", "one")
    ended(reads)
    assert one["self"] == one["group"] != os.getpid()
    assert (one["begun"] == one["self"]) is not copied


@forks
def test_all_are_copies_of_one_process_with_limits_of_their_own_and_one_that_fails_ends(told):
    found = []
    for function in ("said", "limited", "failing", "said"):
        one, reads = told(function, f"{len(found)}")
        found.append(one)
        ended(reads)
    assert len({one["self"] for one in found}) == 4
    assert {one["begun"] for one in found} == {one["parent"] for one in found} == {found[0]["begun"]}
    free = resource.getrlimit(resource.RLIMIT_DATA)[0]
    assert [one["memory"] for one in found] == [free, 2**29, free, free]


@forks
def test_the_process_that_is_copied_may_be_killed_and_copies_go_on(told):
    one, reads = told("said", "a", 1.0)
    os.kill(one["parent"], signal.SIGKILL)
    os.waitpid(one["parent"], 0)
    os.kill(one["self"], 0)  # is there
    ended(reads)
    other, reads = told("said", "b")
    ended(reads)
    assert other["parent"] != one["parent"]


@forks
def test_the_process_that_is_copied_ends_with_whoever_gave_orders(tmp_path):
    program = "import os; from rotordrop.child import Starter; s = Starter(); r, w = os.pipe(); " + (
        "s.start('time', 'sleep', 3.0, imports=(), held=w); print(s._server.pid, flush=True); "
        "os.kill(os.getpid(), 9)"
    )
    paths = os.pathsep.join(filter(None, sys.path))
    with os.popen(f"PYTHONPATH={paths} {sys.executable} -c {program!r}") as out:
        server = int(out.readline())
    until = time.monotonic() + 600.0
    while Path(f"/proc/{server}").exists() and "Z" not in Path(f"/proc/{server}/stat").read_text():
        assert time.monotonic() < until
        time.sleep(0.05)
