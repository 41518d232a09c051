"""A diagnosis that is ended early reports what it has found by then, and says so."""

import os
import signal
import time
from html import unescape

import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.report import render_report, summary
from bumblebee.diagnosis.simulation import OutOfTime, Stop, ending
from bumblebee.diagnosis.simulation.stop import check
from bumblebee.first_signal import first_signal
from bumblebee.teller import Teller
from tests.diagnosis.arm import SMALL, session_of, simulate

WEAK = {("motor_strength", "j3"): 0.7, ("coulomb_friction", "j1"): 0.4}


def test_only_within_a_search_and_once_it_is_over_the_simulator_stops_it():
    stop = Stop()
    with ending(lambda: stop.over(0)):
        check()
        stop.asked = True
        with pytest.raises(OutOfTime):
            check()
    check()
    assert Stop(minutes=0.0).over(0) and not Stop(minutes=9.0).over(9) and not Stop().over(99)


def test_the_search_leaves_the_time_that_fit_and_errors_of_its_effects_take():
    stop = Stop(minutes=1.0, opened=4.0, last_fit=2.0, an_effect=0.5)  # 8 s, and 2 s an effect
    stop.began = time.monotonic() - 30.0
    assert not stop.over(10) and stop.over(12)


def test_what_was_found_before_the_signal_is_fitted_and_reported():
    stop = Stop()

    def say(text: str) -> None:
        stop.asked = stop.asked or text.startswith("comparing each effect")

    told = diagnose(session_of(simulate(WEAK, seed=3)), SMALL, say, stop).document
    found = {(e["effect"], *e["where"]): e["parameters"] for e in told["effects"]}
    low, high = found["motor_strength", "j3"]["factor"]["ci95"]
    assert low < 0.7 < high and ("coulomb_friction", "j1") in found
    ended = [note for note in told["notes"] if "ended early, by `--minutes` or a signal" in note]
    assert len(ended) == 2 and "the step that was going on" in ended[0]
    assert summary(told).startswith(f"WARNING: {ended[0]}\nWARNING: {ended[1]}\n")
    page = unescape(render_report(told, []))
    assert all(page.count(note) == 1 and page.index(note) < page.index("class='lead first'") for note in ended)


def test_time_that_is_over_at_once_leaves_the_declared_model_and_its_error():
    told = diagnose(session_of(simulate(WEAK, seed=3)), SMALL, stop=Stop(minutes=0.0)).document
    assert told["effects"] == [] and told["error"]["before"]["0.2"]["chi2"]["value"] > 2.0
    assert [note for note in told["notes"] if "the step that was going on" in note or "more effects" in note]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_is_taken_and_the_second_ends_as_ever(number):
    came, before = [], signal.signal(number, lambda *_: came.append("ends"))
    try:
        with first_signal(lambda: came.append("first") or True):
            os.kill(os.getpid(), number)
            assert came == ["first"]
            os.kill(os.getpid(), number)
            assert came == ["first", "ends"]
        with first_signal(lambda: False):
            os.kill(os.getpid(), number)
            assert came == ["first", "ends", "ends"]
    finally:
        signal.signal(number, before)


def test_silence_is_broken_by_what_goes_on_and_what_was_found(capsys):
    with Teller(every=0.05) as say:
        say("found kp on j1: [0.5]")
        say("final fit")
        end = time.monotonic() + 5.0
        told = ""
        while "still" not in told and time.monotonic() < end:
            time.sleep(0.02)
            told += capsys.readouterr().out
    assert "] still: final fit; 1 found, at last kp on j1\n" in told
