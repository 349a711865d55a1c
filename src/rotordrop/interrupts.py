"""Ctrl-C that is never lost.

An interrupt that arrives while foreign code calls back into Python, as the compiler does several times per
kernel, cannot travel further: Python prints it as ignored and goes on, or fails later for a reason that has
nothing to do with it. It is raised again here a moment later, and told apart from a fault.
"""

from __future__ import annotations

import signal
import sys
from _thread import interrupt_main
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread, Timer
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

Result = TypeVar("Result")

AGAIN_AFTER_S = 0.02
"""Until an ignored interrupt is raised again [s]: the callback that ignored it has returned by then; chosen,
not measured."""


@contextmanager
def interruptions_kept() -> Iterator[Callable[[], bool]]:
    """Raise again each interrupt that foreign code ignored; yields whether Ctrl-C was pressed at all.

    Where Ctrl-C means something else already, as in a job that is to outlive its terminal, it keeps that.
    """
    pressed = Event()
    timers: list[Timer] = []
    print_ignored = sys.unraisablehook
    handler = signal.getsignal(signal.SIGINT)

    def interrupt(_number: int, _frame: object) -> None:
        pressed.set()
        raise KeyboardInterrupt

    def raise_again(ignored: UnraisableHookArgs) -> None:
        if ignored.exc_type is KeyboardInterrupt:
            timers.append(Timer(AGAIN_AFTER_S, interrupt_main))
            timers[-1].start()
        elif not pressed.is_set():  # what an interrupt left half built complains when it is deleted
            print_ignored(ignored)

    if handler is signal.default_int_handler:
        signal.signal(signal.SIGINT, interrupt)
    sys.unraisablehook = raise_again
    try:
        yield pressed.is_set
    finally:
        for timer in timers:
            timer.cancel()
        sys.unraisablehook = print_ignored


def interruptible(compute: Callable[[], Result]) -> Result:
    """Compute in a thread of its own, so that Ctrl-C is noticed while compiled code runs for minutes.

    The thread is left behind then; it ends with the program.
    """
    results: list[Result] = []
    faults: list[BaseException] = []

    def attempt() -> None:
        try:
            results.append(compute())
        except BaseException as fault:  # noqa: BLE001  raised again below, in the thread that waits
            faults.append(fault)

    worker = Thread(target=attempt, daemon=True)
    worker.start()
    while worker.is_alive():
        worker.join(0.1)  # a join without end would keep the interrupt waiting on some systems
    if faults:
        raise faults[0]
    return results[0]
