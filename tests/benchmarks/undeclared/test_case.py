"""A case is scored whatever the diagnosis does."""

import pytest

from benchmarks.undeclared import case
from benchmarks.undeclared.lottery import Suite
from benchmarks.undeclared.rivals import oracle
from benchmarks.undeclared.robots import declared
from bumblebee.stand_in.undeclared.kind import Place
from bumblebee.stand_in.undeclared.kinds import CATALOGUE, KINDS, LATER


def test_a_diagnosis_that_breaks_counts_as_one_that_names_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(session: object) -> None:
        raise ValueError("no such luck")

    monkeypatch.setattr(case, "diagnose", broken)
    chosen = next(c for c in Suite(1).cases() if c.robot == "arm" and c.group == "single" and not c.rivals)
    line = case.run_case(chosen, 1)
    assert "failed" not in line and line["broke"] == "ValueError: no such luck"
    assert line["ours"]["named"] == [] and not any(line["ours"]["found"]) and not line["ours"]["top"]
    assert line["errors"]["ours"] == line["errors"]["before"]


@pytest.mark.parametrize("name", [kind.name for kind in (*CATALOGUE, *LATER) if kind.on == "joint"])
def test_the_oracle_takes_every_kind_of_a_joint_or_says_that_it_cannot(name: str) -> None:
    arm, kind = declared("arm"), KINDS[name]
    place = Place(arm, "elbow", {"sign": 1, "axis": 0, "number": 5, "other": "lift"}, 5.0, 2.0, 2.0)
    truth = {"effect": name, "where": ["elbow"], "parameters": kind.make(place, kind.first(place))[1]}
    answer = oracle.run(arm, [truth])
    assert answer is None or answer.named[0] == {"effect": name, "where": ["elbow"]}
