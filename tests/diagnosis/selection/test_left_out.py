"""A step of the search that cannot be computed is left out with a line in the notes; the rest goes on."""

import numpy as np
import pytest

from bumblebee.diagnosis import diagnose as whole
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.selection import forward, rounds
from tests.diagnosis.arm import SMALL, session_of, simulate


def singular(*args, **given):
    raise np.linalg.LinAlgError("Singular matrix")


def test_a_step_of_the_search_that_fails_costs_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("saturation_trials", "backlash_trials", "joint_elasticity_trials"):
        monkeypatch.setattr(rounds, name, singular)
    for name in ("swap", "find_packet_loss"):
        monkeypatch.setattr(forward, name, singular)
    monkeypatch.setattr(whole, "discover", singular)
    session = session_of(simulate({("coulomb_friction", "j2"): 0.4}, count=3))
    found = diagnose(session, SMALL).document
    assert [(e["effect"], e["where"]) for e in found["effects"]] == [("coulomb_friction", ["j2"])]
    left_out = [note for note in found["notes"] if note.startswith("left out of the search")]
    assert {note.split(": ")[1].split(" (")[0] for note in left_out} >= {"swap steps", "backlash", "model discrepancy"}
    assert all("Singular matrix" in note for note in left_out)
    assert session.plant.failures.notes(5) == []  # of this diagnosis, not of the session
