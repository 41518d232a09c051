"""The film shows a motion that failed on the robot before the round and is followed after it, the liveliest such."""

import numpy as np
import pandas as pd
import pytest

from bumblebee.measured.rollout import Rollout
from bumblebee.report.films import filmstrip
from bumblebee.report.films.film_choice import Choice, won_back
from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.robot.model import build_spec

SPEED = {"walk": 0.9, "bow": 0.1, "turn": 0.5}


def rows(kind: str, number: int, good: str, engine: str = "stand_in") -> list[dict[str, object]]:
    """Episodes of three motions, those named in `good` followed."""
    return [
        {"kind": kind, "round": number, "engine": engine, "motion": motion, "cluster": "c0", "seed": 4,
         "success": motion in good.split(), "frames": 70}
        for motion in SPEED
    ]  # fmt: skip


def chosen(*parts: list[dict[str, object]], asked: str = "") -> list[Choice]:
    return won_back(pd.DataFrame([row for part in parts for row in part]), SPEED, 1, 0, asked)


def test_the_liveliest_motion_that_was_won_back_comes_first() -> None:
    found = chosen(rows("expert", 0, ""), rows("expert", 1, "bow turn"), rows("compensated", 0, "walk"))
    assert [c.motion for c in found] == ["turn", "bow"]
    assert found[0] == Choice("turn", "c0", 4, "refined", 70)


def test_the_compensated_policy_is_shown_where_the_refined_one_won_nothing() -> None:
    found = chosen(rows("expert", 0, "walk"), rows("expert", 1, "walk"), rows("compensated", 0, "walk bow"))
    assert [(c.motion, c.after) for c in found] == [("bow", "compensated")]


def test_nothing_is_chosen_where_nothing_was_won_back_or_only_on_the_declared_model() -> None:
    assert chosen(rows("expert", 0, "walk"), rows("expert", 1, "walk")) == []
    assert chosen(rows("expert", 0, "", "nominal"), rows("expert", 1, "walk", "nominal")) == []
    assert chosen(rows("expert", 0, "")) == []


def test_a_motion_that_is_asked_for_is_the_only_one() -> None:
    parts = (rows("expert", 0, ""), rows("expert", 1, "bow turn"))
    assert [c.motion for c in chosen(*parts, asked="bow")] == ["bow"] and chosen(*parts, asked="walk") == []


def rollout(rows: int) -> Rollout:
    still = np.tile(stand_pose(), (rows, 1))
    return Rollout(
        "r", joint_names(), 50, np.arange(rows) / 50, still, np.zeros((rows, 23)), joint_target=still,
        base_quat=np.tile([1.0, 0, 0, 0], (rows, 1)), base_pos=np.tile([0, 0, 0.784], (rows, 1)),
    )  # fmt: skip


def test_both_runs_stand_side_by_side_on_one_clock_and_the_fallen_one_turns_pale(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[np.ndarray] = []
    grey = lambda xml, qpos, width, height: (np.full((len(qpos), 4, 6, 3), 100, np.uint8), "test")  # noqa: E731
    monkeypatch.setattr(filmstrip, "render_frames", grey)
    monkeypatch.setattr(filmstrip, "_webp", lambda pixels: made.append(pixels) or b"")
    film = filmstrip.film_pair(rollout(50), rollout(100), "<mujoco/>", start=0.5, fps=10)
    assert film.sheet is not None and film.sheet.frames == 15 and film.sheet.width == 2 * 6 + 8
    first, sixth = made[0][0, :20], made[0][0, 20 * 5 : 20 * 6]
    assert (first[:6] == 100).all() and (first[6:14] == 255).all() and (first[14:] == 100).all()
    assert (sixth[:6] == 185).all() and (sixth[14:] == 100).all()


def test_stills_of_both_stand_in_where_nothing_renders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filmstrip, "render_frames", lambda *_, **__: (None, "egl: no device"))
    spec = build_spec()
    spec.compile()
    film = filmstrip.film_pair(rollout(10), rollout(30), spec.to_xml())
    assert film.sheet is None and len(film.stills) == 6 and "no device" in film.note
