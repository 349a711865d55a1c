"""One thread for linear algebra inside estimates and studies, whoever calls; then the caller's setting."""

from threading import Barrier, Thread

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from rotordrop import (
    calibrate_machine,
    estimate_drop,
    example_machine,
    example_record_path,
    read_record,
    sweep,
)
from rotordrop.one_thread import one_thread

import scipy.linalg  # noqa: F401, isort: skip - brings the second library


class Enough(Exception):
    """Ends a computation from its progress."""


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(2, user_api="blas"):
        if set(threads()) != {2}:
            pytest.skip("linear algebra has one thread here")
        yield


def threads():
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_the_last_of_several_threads_restores_the_callers_setting():
    meet, seen = Barrier(2), []

    def early():
        with one_thread():
            meet.wait()
            seen.append(threads())
        meet.wait()

    other = Thread(target=early)
    with_late = one_thread()
    other.start()
    with with_late:
        meet.wait()
        meet.wait()
        seen.append(threads())
    other.join()
    assert {number for one in seen for number in one} == {1}
    assert set(threads()) == {2}


def test_an_error_inside_restores_it_too():
    with pytest.raises(Enough), one_thread():
        assert set(threads()) == {1}
        raise Enough
    assert set(threads()) == {2}


COMPUTED = {
    "estimated": lambda machine, record, told: estimate_drop(machine, record, progress=told),
    "calibrated": lambda machine, record, told: calibrate_machine(machine, [record], [None], progress=told),
    "studied": lambda machine, _, told: sweep(machine, {"speed": ["60 Hz"]}, duration="1 ms", progress=told),
}


@pytest.mark.parametrize("compute", COMPUTED.values(), ids=COMPUTED)
def test_whoever_calls_computes_on_one_thread(compute):
    seen = []

    def told(*_):
        seen.extend(threads())
        raise Enough

    machine = example_machine("lp400")
    record = read_record(example_record_path("lp400_drop_060"), machine)
    with pytest.raises(Enough):
        compute(machine, record, told)
    assert set(seen) == {1}
    assert set(threads()) == {2}
