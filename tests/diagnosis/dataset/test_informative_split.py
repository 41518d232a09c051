"""Which rollouts are fitted: one that alone shows an effect is, however the rollouts had been divided."""

from dataclasses import replace
from functools import cache

from bumblebee.diagnosis.dataset.informative_split import informative
from bumblebee.diagnosis.dataset.session import Session
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate

LIMIT = 8.0


def _session(rollouts: list[Rollout]) -> Session:
    return arm.session_of(rollouts)


@cache
def _four(limited: bool) -> list[Rollout]:
    return simulate({("torque_limit", "j2"): (LIMIT,)} if limited else {}, count=4, seed=3)


def _mixed(limited: int) -> list[Rollout]:
    """Three rollouts without an effect and one, number `limited`, in which the second joint's drive has a limit."""
    return [_four(i == limited)[i] for i in range(4)]


def test_a_rollout_that_alone_shows_an_effect_is_fitted() -> None:
    (aside,) = _session(_mixed(0)).holdout
    session = _session(_mixed(aside))
    moved = informative(session, 0.2)
    assert session.holdout == session.accept == [aside]
    assert aside in moved.train and aside not in moved.accept
    assert len(moved.train) == len(session.train) and len(moved.holdout) == 1 and moved.holdout == moved.accept
    assert session.rollouts[aside].rollout_id in moved.notes[-1]


def test_rollouts_keep_their_places_where_none_shows_more_or_a_fitted_one_does() -> None:
    fitted = next(i for i in range(4) if i not in _session(_four(False)).holdout)
    for session in (_session(_four(True)), _session(_four(False)), _session(_mixed(fitted))):
        assert informative(session, 0.2) is session


def test_a_repeat_stays_on_its_side() -> None:
    """Motions that have names and were put aside are not parted from their repeats."""
    rollouts = [replace(r, meta=r.meta | {"motion": f"m{i}"}) for i, r in enumerate(_four(False))]
    (aside,) = _session(rollouts).holdout
    rollouts[aside] = replace(_mixed(aside)[aside], meta=rollouts[aside].meta)
    rollouts.append(replace(rollouts[aside], rollout_id="r99"))
    moved = informative(_session(rollouts), 0.2)
    assert (aside in moved.train) == (4 in moved.train)


def _at(rollouts: list[Rollout], gains: list[float]) -> Session:
    """The rollouts, as if the second joint's servo had had these times its declared damping."""
    kp, kd = [40.0, 60.0, 30.0], [3.0, 4.0, 2.0]
    return _session(
        [
            replace(r, meta=r.meta | {"kp": kp, "kd": [kd[0], g * kd[1], kd[2]]})
            for r, g in zip(rollouts, gains, strict=True)
        ]
    )


def test_a_rollout_that_alone_has_a_condition_is_fitted_and_stays_so() -> None:
    (aside,) = _session(_four(False)).holdout
    gains = [0.97 if i == aside else 1.0 for i in range(4)]
    moved = informative(_at(_four(False), gains), 0.2)
    assert aside in moved.train and aside not in moved.accept
    assert len(moved.holdout) == 1 and "under a condition that no fitted rollout has" in moved.notes[-1]
    # One that shows more than all takes another's place, not the condition's.
    other = next(i for i in range(4) if i != aside)
    both = informative(_at(_mixed(other), gains), 0.2)
    assert {aside, other} <= set(both.train) - set(both.accept)


def test_rollouts_keep_their_places_where_each_has_a_condition_of_its_own() -> None:
    session = _at(_four(False), [0.96, 0.97, 0.98, 0.99])
    assert informative(session, 0.2) is session
