"""Three sets of gains, fitted together, tell apart what one cannot."""

from dataclasses import replace

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm

THREE = ((0.5, 0.4), (1.0, 1.0), (2.0, 3.0))
CONFIG = replace(arm.SMALL, beyond=False)


def recorded(truth: dict[tuple[str, str], float], gains: tuple[tuple[float, float], ...]) -> list[Rollout]:
    """Six rollouts, as many under each set of gains."""
    each = 6 // len(gains)
    every = [arm.simulate(truth, count=each, seconds=3.0, seed=k, gains=g) for k, g in enumerate(gains)]
    return [replace(r, rollout_id=f"g{k}-{r.rollout_id}") for k, some in enumerate(every) for r in some]


def test_viscous_friction_is_told_from_the_drives_damping_by_three_gains() -> None:
    truth = {("viscous_friction", "j2"): 1.0}
    one, three = (diagnose(arm.session_of(recorded(truth, g)), CONFIG).document for g in (THREE[1:2], THREE))
    (at_one,), (at_three,) = one["effects"], three["effects"]
    assert {at_one["effect"], *(e["effect"] for e in at_one["equivalent"])} >= {"viscous_friction", "kd"}
    assert (at_three["effect"], at_three["where"]) == ("viscous_friction", ["j2"])
    assert not {e["effect"] for e in at_three["equivalent"]} - {"quadratic_friction"}  # of the same family
    low, high = at_three["parameters"]["damping"]["ci95"]
    assert low < 1.0 < high and high - low < 0.1
    assert set(three["conditions"]) == {f"{key}[{joint}]" for key in ("kp", "kd") for joint in arm.JOINTS}
