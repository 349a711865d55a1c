"""What may stand where the program keeps a file, and a limit of time for who opens it."""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from pathlib import Path

import pytest


def _socket(place: Path) -> None:
    with chdir(place.parent), socket.socket(socket.AF_UNIX) as made:  # names of sockets are short
        made.bind(place.name)


NO_FILE: dict[str, Callable[[Path], object]] = {
    "folder": lambda place: (place / "in it").mkdir(parents=True),
    "pipe": lambda place: os.mkfifo(place),
    "socket": _socket,
    "link that leads nowhere": lambda place: place.symlink_to("nowhere"),
    "device": lambda place: place.symlink_to("/dev/zero"),
}

on_posix = pytest.mark.skipif(os.name != "posix", reason="pipes, sockets and links as on POSIX")


@contextmanager
def in_time(seconds: int = 60) -> Iterator[None]:
    """Fail what waits for somebody at the other end of a pipe."""

    def fail(*_: object) -> None:
        raise AssertionError(f"it waits for more than {seconds} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
