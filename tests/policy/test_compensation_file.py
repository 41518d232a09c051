"""compensation.json and what is made of it: round trip, refusals, the command line, logs of compensated runs."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bumblebee.cli import run
from bumblebee.compensation.file import load_compensations, read_compensation, table_of, write_compensation
from bumblebee.compensation.numbers import Compensation, as_table
from bumblebee.compensation.plan import compensate
from bumblebee.compensation.runtime import put_right_rollout
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.measured.intake import intake
from bumblebee.measured.rollout import write_rollout
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.robot.model import build_model
from bumblebee.robot.sensors import NO_NOISE
from bumblebee.sim.effects import Effect, write_effects
from tests.policy.conftest import nod

KNEE = "left_knee_joint"
EFFECTS = [
    Effect("encoder_offset", (KNEE,), {"offset": 0.05}),
    Effect("motor_strength", ("right_knee_joint",), {"factor": 0.8}),
    Effect("coulomb_friction", (KNEE,), {"frictionloss": 2.0}),
    Effect("cogging", ("left_elbow_joint",), {"sine": 0.5, "cosine": 0.1, "periods": 12.0}),
    Effect("hysteresis", ("right_elbow_joint",), {"amplitude": 0.5, "width": 0.05, "dahl": 1.0}),
    Effect("link_mass", ("torso_link",), {"mass": 9.0}),
    Effect("imu_offset", ("pelvis",), {"roll": 0.02, "pitch": -0.01}),
    Effect("discovered", (KNEE,), {"sin(3*q)": 0.5, "friction(q^2)": 0.1}),
]


@pytest.fixture
def made() -> Compensation:
    return compensate(EFFECTS)


def test_a_file_gives_back_what_was_written_to_the_last_bit(made: Compensation, tmp_path: Path) -> None:
    write_compensation(tmp_path / "compensation.json", made)
    again = read_compensation(tmp_path / "compensation.json")
    assert as_table(again) == as_table(made) and again.sha256 == made.sha256
    assert as_table(again)["plan"][0]["size"] == "+0.05 rad"


def test_its_hash_changes_with_any_number(made: Compensation) -> None:
    assert compensate(EFFECTS).sha256 == made.sha256
    other = [Effect("encoder_offset", (KNEE,), {"offset": 0.0500001}), *EFFECTS[1:]]
    assert compensate(other).sha256 != made.sha256


WRONG: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "schema": (lambda t: t.update(schema=2), "schema: expected 1, came 2"),
    "robot": (lambda t: t.update(robot="h1"), "robot: expected 'g1_23dof', came 'h1'"),
    "joints": (lambda t: t["joints"].reverse(), "joints: expected the G1's 23 joints in order"),
    "lacking": (lambda t: t.pop("kp"), "came no key kp"),
    "unknown": (lambda t: t.update(torque=1), "the unknown key 'torque'"),
    "short": (lambda t: t["kd"].pop(), "kd: expected 23 numbers, came 22"),
    "text": (lambda t: t["bias"].__setitem__(3, "1"), "bias[3]: expected a number"),
    "huge": (lambda t: t["dry"].__setitem__(3, 1e30), "dry[3]: expected a number of at most 10000"),
    "stiff": (lambda t: t["kp"].__setitem__(0, 9e3), "kp[0]: expected 0.4 to 2.5 times the declared gain"),
    "weakest": (lambda t: t["strength"].__setitem__(0, 0.0), "strength[0]: expected"),
    "far": (lambda t: t["encoder_offset"].__setitem__(0, 0.4), "encoder_offset[0]: expected -0.3 to 0.3, came 0.4"),
    "early": (lambda t: t["lead_time"].__setitem__(0, 0.5), "lead_time[0]"),
    "tilted": (lambda t: t.update(imu=[0.3, 0, 0]), "imu[0]"),
    "limits": (lambda t: t["limits"].update(torque_share=5.0), "limits.torque_share: expected a number above 0"),
    "joint": (lambda t: t["cogging"][0].__setitem__(0, 23), "cogging[0]: expected the number of a joint first"),
    "width": (lambda t: t["hysteresis"][0].__setitem__(2, 0.0), "hysteresis[0]: expected a width above 0"),
    "formula": (lambda t: t["terms"][0].__setitem__(2, "__import__('os')"), "expected a formula"),
    "memory": (lambda t: t["terms"][0].__setitem__(2, "rested(0.1, 1)"), "a formula of angles, velocities"),
    "body": (lambda t: t["loads"][0].update(body="x"), "loads[0].body: expected a body of the G1"),
    "mass": (lambda t: t["loads"][0].update(mass=[1, 0]), "loads[0].mass: expected masses above 0"),
    "escape": (lambda t: t["plan"][0].update(done="\x1b[2J"), "plan[0].done: expected one line"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_file_that_was_changed_by_hand_is_refused_by_its_field(name: str, made: Compensation, tmp_path: Path) -> None:
    change, words = WRONG[name]
    table = json.loads(json.dumps(as_table(made)))
    change(table)
    (tmp_path / "compensation.json").write_text(json.dumps(table))
    with pytest.raises(BadInput) as caught:
        read_compensation(tmp_path / "compensation.json")
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_a_plan_names_compensations_of_its_own_policies_only(made: Compensation, tmp_path: Path) -> None:
    path = tmp_path / "compensation.json"
    write_compensation(path, made)
    plan = {"policies": {"a": "x", "b": "x"}, "compensations": {"b": str(path)}}
    assert {key: c.sha256 for key, c in load_compensations(plan, "plan.json").items()} == {"b": made.sha256}
    assert load_compensations({"policies": {"a": "x"}}, "plan.json") == {}
    with pytest.raises(BadInput, match=r"plan.json: compensations: expected keys among a, b, came 'c'"):
        load_compensations(plan | {"compensations": {"c": str(path)}}, "plan.json")
    with pytest.raises(BadInput, match="policies' keys with paths"):
        load_compensations(plan | {"compensations": ["b"]}, "plan.json")


def test_the_command_writes_the_file_and_shows_what_is_done(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    effects, out = tmp_path / "effects.yaml", tmp_path / "compensation.json"
    write_effects(effects, [*EFFECTS, Effect("backlash", (KNEE,), {"gap": 0.01})])
    with pytest.raises(BadInput, match=r"effects\[8\]: backlash: .*--leave-out"):
        run(["compensate", str(effects), "--out", str(out)])
    assert not out.exists()
    assert run(["compensate", str(effects), "--out", str(out), "--leave-out"]) == 0
    said = capsys.readouterr().out
    assert "+0.05 rad" in said and "NOT UNDONE: within its play" in said and "times 1.25" in said
    made = read_compensation(out)
    assert table_of(made) in said
    with pytest.raises(BadInput, match="--overwrite"):
        run(["compensate", str(effects), "--out", str(out), "--leave-out"])
    assert run(["compensate", str(effects), "--out", str(out), "--leave-out", "--overwrite"]) == 0
    with pytest.raises(BadInput, match="does not contain the input"):
        run(["compensate", str(effects), "--out", str(effects), "--leave-out", "--overwrite"])
    assert run(["compensate", str(effects)]) == EXIT_BAD_INPUT


def test_a_model_of_another_robot_is_refused(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text("<mujoco><worldbody/></mujoco>")
    write_effects(tmp_path / "effects.yaml", EFFECTS)
    with pytest.raises(BadInput, match=r"arm.xml: expected a model of the G1, .*Only policies of the G1"):
        run(["compensate", str(tmp_path / "effects.yaml"), "--out", str(tmp_path / "c.json"), "--model",
             str(tmp_path / "arm.xml")])  # fmt: skip
    assert not (tmp_path / "c.json").exists()


def test_effects_of_another_robot_are_refused_before_all_else(tmp_path: Path) -> None:
    """By the joints that they name, or, where they are of the whole robot, by those of the diagnosis beside them."""
    path, out = tmp_path / "effects.yaml", tmp_path / "c.json"
    write_effects(path, [Effect("coulomb_friction", ("elbow",), {"frictionloss": 0.1})])
    line = r"yaml: expected joints and bodies of the G1, came 'elbow', of another robot. Only policies of the G1 have"
    for options in ([], ["--leave-out"]):
        with pytest.raises(BadInput, match=line):
            run(["compensate", str(path), "--out", str(out), *options])
    write_effects(path, [Effect("command_delay", (), {"delay": 0.01})])
    (tmp_path / "diagnosis.json").write_text(json.dumps({"units": {"shoulder": {}, "elbow": {}}, "effects": [1]}))
    with pytest.raises(BadInput, match=r"diagnosis.json: expected joints and bodies of the G1, came 'shoulder'"):
        run(["compensate", str(path), "--out", str(out), "--unproven"])
    (tmp_path / "diagnosis.json").write_text(json.dumps({"units": {KNEE: {}}, "effects": []}))
    assert run(["compensate", str(path), "--out", str(out)]) == 0


def test_one_policy_runs_with_and_without_and_the_log_of_the_one_with_is_set_aside(
    policy_folder: Callable[..., Path], tmp_path: Path
) -> None:
    """Two keys, one folder: the plain run is what it is alone, the other says what was sent and is no data."""
    policy, clip = ExportedPolicy.load(policy_folder(gain=0.02)), nod(frames=12)
    undone = compensate([Effect("encoder_offset", (KNEE,), {"offset": 0.05}), *EFFECTS[1:3]])
    make = lambda count: NominalRobots(count, threads=1)  # noqa: E731
    both = [Episode("plain", "raw", "nod", 1), Episode("other", "undone", "nod", 1)]
    policies, clips = {"raw": policy, "undone": policy}, {"nod": clip}
    alone = run_episodes(make, both[:1], policies, clips, NO_NOISE)[0]
    plain, other = run_episodes(make, both, policies, clips, NO_NOISE, compensations={"undone": undone})
    for name in ("joint_pos", "joint_target", "action", "joint_torque"):
        assert np.array_equal(getattr(plain, name), getattr(alone, name)), name
    assert plain.meta == alone.meta and "compensation" not in plain.meta
    assert other.meta["compensation"] == undone.sha256 and other.meta["kp"] == undone.kp.tolist()
    assert other.joint_target is not None and plain.joint_target is not None
    assert other.joint_target[0, 3] - plain.joint_target[0, 3] == pytest.approx(0.05, abs=0.02)
    assert np.allclose(put_right_rollout(undone, other).joint_pos[:, 3], other.joint_pos[:, 3] - 0.05)
    for rollout in (plain, other):
        write_rollout(tmp_path / "in" / f"{rollout.rollout_id}.parquet", rollout)
    taken = intake(tmp_path / "in", tmp_path / "accepted", tmp_path / "aside", build_model())
    found = taken.findings[taken.findings["file"] == "other.parquet"]
    assert "other.parquet" in taken.quarantined and list(found["rule"]) == ["compensated"]
    assert "uncompensated robot" in found["message"].iloc[0] and undone.sha256[:12] in found["message"].iloc[0]
    assert "compensated" not in set(taken.findings[taken.findings["file"] == "plain.parquet"]["rule"])
