"""A plan in some minutes: chosen among the candidates that were looked at, and safe all the same."""

from collections import Counter
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.plan import Plan, findings_of, make_plan
from bumblebee.diagnosis.plan import plan as planning
from bumblebee.diagnosis.plan.motions import FAMILIES
from bumblebee.diagnosis.plan.safety import LATE, Safe
from bumblebee.diagnosis.plan.stage import Stage
from bumblebee.diagnosis.plan.written.document import notes
from bumblebee.diagnosis.simulation import Stop
from bumblebee.errors import BadInput
from tests.diagnosis.arm import XML
from tests.diagnosis.plan.made import LIMITS, friction, slow_session

POOL = 4 * len(FAMILIES)


def plan_until(stop: Stop) -> Plan:
    spec, config = mujoco.MjSpec.from_string(XML), replace(LIMITS, pool=POOL)
    return make_plan(spec, "arm.xml", config, slow_session(), findings_of(*friction()), stop=stop)


def test_the_first_candidates_are_looked_at_however_little_time_there_is_and_the_plan_says_how_many() -> None:
    plan = plan_until(Stop(minutes=1e-6))
    assert plan.refused[LATE] == POOL - len(FAMILIES)
    assert 1 <= len(plan.motions) <= LIMITS.runs and all(m.number < len(FAMILIES) for m in plan.motions)
    assert (plan.reached <= 1.0).all()
    assert any(f"{plan.refused[LATE]} of {POOL} candidates were not looked at" in note for note in notes(plan))


def test_with_time_enough_every_candidate_is_looked_at() -> None:
    plan = plan_until(Stop(minutes=100.0))
    assert LATE not in plan.refused and not any("not looked at" in note for note in notes(plan))


def test_a_signal_ends_the_search_between_candidates(monkeypatch: pytest.MonkeyPatch) -> None:
    stop, seen = Stop(minutes=100.0), []

    def looked(stage: object, motions: list) -> Safe:
        seen.append(len(motions))
        stop.asked = len(seen) == 2
        return made_safe(stage, motions)

    made_safe = planning.made_safe
    monkeypatch.setattr(planning, "made_safe", looked)
    assert plan_until(stop).refused[LATE] == POOL - 2 * len(FAMILIES)
    assert seen == [len(FAMILIES)] * 2 and stop.searching


def test_once_the_time_is_over_only_what_was_rehearsed_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    stop = Stop(minutes=100.0)
    rehearsed: list[int] = []

    def none_of_the_first(stage: object, motions: list) -> Safe:
        """The best one is never safe, and then the time is over."""
        rehearsed.extend(m.number for m in motions)
        stop.asked = True
        safe = proven(stage, motions)
        return replace(safe, motions=safe.motions[1:], reached=safe.reached[1:])

    proven = planning.proven
    monkeypatch.setattr(planning, "proven", none_of_the_first)
    plan = plan_until(stop)
    assert {m.number for m in plan.motions} <= set(rehearsed) and len(rehearsed) == LIMITS.runs
    assert len(plan.motions) == LIMITS.runs - 1 and np.isfinite(plan.runs).all()


def test_where_nothing_was_safe_when_the_time_was_over_it_ends_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def none_is(stage: Stage, motions: list) -> Safe:
        seen.append(len(motions))
        return Safe([], np.zeros((0, 3, 3)), Counter({"j1 leaves its range": len(motions)}))

    monkeypatch.setattr(planning, "made_safe", none_is)
    with pytest.raises(BadInput, match=r"none; \d+ of them: not looked at: the time was over. Give more --minutes"):
        plan_until(Stop(minutes=1e-6))
    assert seen == [len(FAMILIES)]
