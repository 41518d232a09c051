"""A run sheet orders motions by what they did in simulation, in the guard's own limits, and speaks for no other run."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.robot.facts import stand_pose
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.tracking.config import Randomisation
from bumblebee.tracking.presets import PAPER_RANDOMISATION
from bumblebee.view.sheet_page import sheet_page
from bumblebee.wire.operator.sheet import Sheet, make_sheet
from bumblebee.wire.operator.sheet_file import NAME, as_json, before_run, read_sheet
from bumblebee.wire.robot_end.drawn_robots import DrawnRobots
from bumblebee.wire.safety.limits import Limits, drives_of
from bumblebee.wire.safety.rules import RULES, Moment, Step, Wish
from bumblebee.wire.safety.uses import Measured, uses
from tests.commands.test_commands import run
from tests.policy.conftest import nod
from tests.wire.made import state

NONE = Randomisation((1.0, 1.0), gains=0.0, mass=0.0, push=0.0)


def rise(name: str = "<rise>") -> Clip:
    """A reference that goes up through the air, below which every robot stays."""
    clip = nod(name, frames=20)
    up = clip.root_pos + np.linspace(0, 1, 20)[:, None] * np.array([0, 0, 1], dtype=np.float32)
    return dataclasses.replace(clip, root_pos=up)


@pytest.fixture(scope="module")
def sheet(shipped: ExportedPolicy) -> Sheet:
    return make_sheet(shipped, [rise(), nod(frames=12)], 2, Limits())


def stepped(robots: NominalRobots) -> np.ndarray:
    count, stand = 3, stand_pose()
    qpos = np.tile(np.concatenate([[0, 0, 0.79, 1, 0, 0, 0], stand]), (count, 1))
    robots.reset(qpos, np.zeros((count, 29)), np.tile(stand, (count, 1)))
    for _ in range(5):
        robots.step(np.arange(count), ServoCommand(np.tile(stand + 0.1, (count, 1))))
    return robots.read().joint_pos


def test_robots_drawn_from_nothing_are_the_declared_one_and_others_differ_but_not_from_themselves() -> None:
    declared, same = stepped(NominalRobots(3, 1)), stepped(DrawnRobots(3, NONE, 0))
    assert np.array_equal(declared, same)
    drawn = DrawnRobots(3, PAPER_RANDOMISATION, 0)
    first, again = stepped(drawn), stepped(drawn)
    assert np.array_equal(first, again) and len(np.unique(first[:, 0])) == 3
    assert not np.array_equal(first, stepped(DrawnRobots(3, PAPER_RANDOMISATION, 1)))


def test_a_pushed_robot_moves_when_its_turn_comes() -> None:
    often = dataclasses.replace(NONE, push=0.5, push_interval=0.06, push_regular=True)
    robots = DrawnRobots(3, often, 0)
    stepped(robots)
    assert np.linalg.norm(robots.read().base_lin_vel[:, :2], axis=1).min() > 0.1


def test_a_use_beyond_one_is_what_the_guards_rule_damps(shipped: ExportedPolicy) -> None:
    """Rules and sheet must not tell two limits for one: at random readings they agree."""
    drives, limits, rng = drives_of(shipped.contract), Limits(), np.random.default_rng(0)
    upright, zero, acted = np.array([1.0, 0, 0, 0]), np.zeros(23), dict.fromkeys(("joint_range", "speed"), 0)
    for _ in range(200):
        pos = rng.uniform(drives.low, drives.high) * rng.uniform(0.9, 1.2)
        vel = rng.uniform(-1, 1, 23) * drives.speed * rng.uniform(0.6, 1.0)
        now = Moment(
            state(joint_pos=pos, joint_vel=vel),
            Wish(pos, zero, zero, zero),
            None,
            True,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            zero,
            5,
        )
        rows = Measured(pos[None], vel[None], zero[None], zero[None], upright[None], np.zeros(1))
        found = uses(rows, upright[None], np.zeros(1), drives, limits)
        for rule in acted:
            damps = RULES[rule](now, drives, limits) is Step.DAMP
            assert damps == (found[rule].share > 1), rule
            acted[rule] += damps
    assert all(0 < count < 200 for count in acted.values())


def test_the_motion_on_which_robots_fall_comes_last_and_its_interval_is_wide(sheet: Sheet) -> None:
    safe, risky = sheet.tried
    assert (safe.motion, safe.fell, safe.share) == ("nod", 0, 0.0) and safe.ci95[1] > 0.5
    assert (risky.motion, risky.fell, risky.share) == ("<rise>", 2, 1.0)
    assert "drop" in risky.watch and risky.uses["drop"][0] > 0.7
    assert 0 < safe.tilt_deg < 20 and safe.room_joint.endswith("_joint")


def test_no_motion_begins_when_the_time_is_over_and_the_sheet_says_which(shipped: ExportedPolicy) -> None:
    made = make_sheet(shipped, [nod(frames=4), nod("other"), nod("more")], 1, Limits(), seconds=0.0)
    assert [one.motion for one in made.tried] == ["nod"] and made.untried == ("other", "more")
    assert "Not tried, the time was over: other, more." in sheet_page(made)


def test_a_sheet_is_read_back_as_it_was_and_its_page_holds_itself(sheet: Sheet, tmp_path: Path) -> None:
    (tmp_path / NAME).write_text(as_json(sheet))
    read = read_sheet(tmp_path)
    assert as_json(read) == as_json(sheet)
    page = sheet_page(read)
    assert "<rise>" not in page and "&lt;rise&gt;" in page and page.index("nod") < page.index("&lt;rise&gt;")
    assert "default-src 'none'" in page and "<script" not in page and "45° from the reference" in page


def test_a_file_that_is_no_sheet_is_refused(sheet: Sheet, tmp_path: Path) -> None:
    for text in ("[]", "{}", '{"sheet": 2}', as_json(sheet).replace('"fell"', '"fel"'), as_json(sheet)[:-20]):
        (tmp_path / NAME).write_text(text)
        with pytest.raises(BadInput) as refused:
            read_sheet(tmp_path)
        assert str(tmp_path / NAME) in str(refused.value)


def test_a_sheet_speaks_for_its_policy_motion_and_limits_alone(sheet: Sheet) -> None:
    clip, limits = nod(frames=12), Limits()
    said = before_run(sheet, sheet.sha256, clip, limits)
    assert "1 of 2 by risk" in said and "watch" in said
    for wrong, what in (
        (("0" * 64, clip, limits), "policy"),
        ((sheet.sha256, nod("sit"), limits), "sit"),
        ((sheet.sha256, nod(frames=13), limits), "another of this name"),
        ((sheet.sha256, clip, Limits(speed=0.3)), "speed"),
    ):
        with pytest.raises(BadInput, match=what):
            before_run(sheet, *wrong)


def test_a_sheet_is_made_and_asked_by_the_commands_that_are_printed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "sheet"
    words = ("deploy", "sheet", "shipped", "--clip", "shrug", "--robots", "1", "--out", out)
    assert run(*words) == 0
    assert capsys.readouterr().out.rstrip().endswith(f"--sheet {out}")
    assert sorted(file.name for file in out.iterdir()) == ["sheet.html", "sheet.json"]
    assert run(*words) == 2 and "one that exists" in capsys.readouterr().err
    assert run("deploy", "run", "shipped", "--clip", "squat", "--unattended", "--sheet", out) == 2
    line = capsys.readouterr().err
    assert "a sheet without it" in line and run(*line.strip().split("bumblebee ")[-1].split()) == 0
