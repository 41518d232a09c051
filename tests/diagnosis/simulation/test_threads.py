"""How many threads simulations take: what the process may use, or what was set; the numbers do not depend on it."""

import os

import mujoco
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from bumblebee.diagnosis import diagnose
from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.simulation import batches, roll
from bumblebee.diagnosis.simulation.batches import threads
from bumblebee.diagnosis.simulation.simulate import residuals
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


def test_as_many_threads_as_processors_that_the_process_may_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batches, "THREADS", None)
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0, 3, 5}, raising=False)
    assert threads() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    assert threads() == 7
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert threads() == 1


def test_no_more_threads_than_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batches, "THREADS", None)
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(500)), raising=False)
    assert threads() == 32


def test_what_was_set_goes_before_what_the_machine_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batches, "THREADS", 5)
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0}, raising=False)
    assert threads() == 5


def test_residuals_are_the_same_on_one_thread_and_on_three(monkeypatch: pytest.MonkeyPatch) -> None:
    session = make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=2, seconds=1.0), "arm", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 4))
    found = []
    monkeypatch.setattr(roll, "_KEPT_BYTES", 0.0)  # each is simulated
    for count in (1, 3):
        monkeypatch.setattr(batches, "THREADS", count)
        found.append(residuals(session.plant, session.layout, windows, [vary(session.plant, [])], 0.005))
    assert np.array_equal(*found)


def test_linear_algebra_takes_one_thread_in_a_diagnosis_and_as_many_as_before_after_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = []

    def gathered(*_: object) -> None:
        seen.append(_blas_threads())
        raise KeyboardInterrupt

    monkeypatch.setattr(diagnose, "gather", gathered)
    with threadpool_limits(2, user_api="blas"):
        before = _blas_threads()
        if before == {1}:
            pytest.skip("a library that takes one thread at most")
        with pytest.raises(KeyboardInterrupt):
            diagnose.diagnose(None)  # type: ignore[arg-type]
        assert seen == [{1}] and _blas_threads() == before


def _blas_threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}
