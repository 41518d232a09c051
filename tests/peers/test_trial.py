"""A peer on motions: what it is given, what the servos are told, who judges it, and the command from end to end."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from benchmarks.baselines.others.follow import follow
from bumblebee import cli
from bumblebee.learning import pretrained
from bumblebee.learning.policy import load_policy
from bumblebee.learning.rollout import Manner, Tick
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.peers.contract import read_contract
from bumblebee.peers.judge import turned_key_errors
from bumblebee.peers.policy import Peer
from bumblebee.peers.rollout import JointOrder, roll_out_peer
from bumblebee.peers.table import differences, table
from bumblebee.peers.trial import Setting, try_ours, try_peer
from bumblebee.peers.world import peer_model
from bumblebee.robot.facts import joint_names
from bumblebee.robot.facts import joints as robot_joints
from bumblebee.robot.model import gains
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.rotations import multiply, rotate
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.benchmarks.others.steps import reference, state, turn_z
from tests.peers.peer import JOINTS, write_contract, write_onnx
from tests.peers.test_contract import TWIST2
from tests.policy.conftest import nod

FACTS = {"physics_hz": 500, "effort_limit": [60.0] * 29, "armature": [0.02] * 29, "floor_friction": 0.8}


@pytest.fixture
def blind(tmp_path: Path) -> tuple[Path, Path]:
    """A peer whose output is always zero and whose targets are the reference: it follows without looking."""
    about = {"action": {"scale": 0.5, "around": "reference"}, "kp": [200.0] * 29, "kd": [8.0] * 29}
    return write_onnx(tmp_path / "p.onnx"), write_contract(tmp_path / "c.yaml", **about)


def test_its_own_model_has_its_facts_within_the_motors_limits(tmp_path: Path):
    model = peer_model(read_contract(write_contract(tmp_path / "c.yaml", **FACTS)), "own", "own")
    assert model.nu == 29 and model.opt.timestep == pytest.approx(0.002)
    knee, wrist = model.actuator("left_knee_joint"), model.actuator("left_wrist_yaw_joint")
    assert knee.gainprm[0] == 100 and knee.biasprm[:3].tolist() == [0, -100, -3]
    assert knee.forcerange.tolist() == [-60, 60] and wrist.forcerange.tolist() == [-5, 5]
    assert model.joint("left_knee_joint").armature[0] == 0.02
    assert model.geom("floor").friction[0] == 0.8 and model.geom("floor").priority[0] > 0


def test_our_model_with_our_gains_is_the_declared_one(tmp_path: Path):
    model = peer_model(read_contract(write_contract(tmp_path / "c.yaml", **FACTS)), "declared", "declared")
    declared = load_model(physics_hz=200.0)
    assert model.nu == 23 and model.opt.timestep == declared.opt.timestep
    for field in ("actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "dof_armature", "geom_friction"):
        assert np.array_equal(getattr(model, field), getattr(declared, field)), field


def test_gains_and_model_are_chosen_apart(tmp_path: Path):
    contract = read_contract(write_contract(tmp_path / "c.yaml", **FACTS))
    knee = next(joint for joint in robot_joints() if joint.name == "left_knee_joint")
    mixed, other = peer_model(contract, "own", "declared"), peer_model(contract, "declared", "own")
    assert mixed.actuator(knee.name).gainprm[0] == pytest.approx(gains(knee)[0])
    assert mixed.joint(knee.name).armature[0] == 0.02 and mixed.nu == 29
    assert other.actuator(knee.name).gainprm[0] == 100 and other.nu == 23
    assert other.joint(knee.name).armature[0] == pytest.approx(knee.armature)


@pytest.mark.parametrize("dof", [23, 29])
def test_joints_go_by_name_and_what_is_not_there_stands_at_zero(tmp_path: Path, dof: int):
    order = JointOrder(read_contract(write_contract(tmp_path / "c.yaml")), dof)
    numbers = {name: float(i + 1) for i, name in enumerate(joint_names(every=True))}
    model, motion = joint_names(every=dof == 29), joint_names()
    values = {names: torch.tensor([[numbers[name] for name in names]]) for names in {model, motion, JOINTS}}
    seen = order.seen(state(joint_pos=values[model], joint_vel=values[model])).joint_pos[0].tolist()
    assert seen == [numbers[name] if name in model else 0.0 for name in JOINTS]
    assert torch.equal(order.targets(values[JOINTS]), values[model])
    assert torch.equal(order.judged(state(joint_pos=values[model], joint_vel=values[model])).joint_pos, values[motion])
    wanted = order.reference(reference(joint_pos=values[motion])).joint_pos[0].tolist()
    assert wanted == [numbers[name] if name in motion else 0.0 for name in JOINTS]
    qpos, qvel = order.start(torch.cat((torch.ones(1, 7), values[motion]), dim=1), torch.ones(1, 29))
    assert qpos.shape == (1, 7 + dof) and qvel.shape == (1, 6 + dof)
    assert qpos[0, 7:].tolist() == [numbers[name] if name in motion else 0.0 for name in model]


def test_servos_are_told_the_default_and_the_clipped_output(tmp_path: Path):
    """The first input's only value that is not zero is the bias: the weight of a term that is constant here."""
    about = {"groups": {"g": [{"term": "reference_height"}]}, "input": [{"groups": ["g"]}]}
    contract = write_contract(tmp_path / "c.yaml", **about)
    weight = np.linspace(-6.0, 6.0, 29)[None]  # about -4.6 to 4.6 times the pelvis' height, beyond the clip of 2
    peer = Peer.load(write_onnx(tmp_path / "p.onnx", width=1, weight=weight), contract)
    engine = MujocoCpu(peer_model(peer.contract, "own", "own"), 1, threads=1)
    clip = nod(frames=4)
    next(iter(roll_out_peer(peer, MotionLibrary([clip], ()), engine)))
    output = np.clip(weight[0] * clip.root_pos[1, 2], -2.0, 2.0)
    wanted = dict(zip(JOINTS, np.array(peer.contract.default_pos) + 0.5 * output, strict=True))
    told = [wanted[name] for name in joint_names(every=True)]
    assert np.allclose(engine.batch.ctrl[0], told, atol=1e-5)


@pytest.mark.parametrize("setting", [Setting(), Setting("declared", "own")], ids=str)
def test_a_peer_that_follows_blindly_stands_and_all_four_rules_say_so(blind: tuple[Path, Path], setting: Setting):
    (row,) = try_peer(Peer.load(*blind), [nod(frames=60)], setting, threads=1).to_dict("records")
    assert row["success"] and row["success_local"] and row["success_heading"] and row["success_upright"]
    assert row["mpkpe_mm"] < 40 and np.isnan(row["lost_at"])


def test_another_control_rate_is_judged_at_its_own_times(tmp_path: Path, blind: tuple[Path, Path]):
    about = {"action": {"scale": 0.5, "around": "reference"}, "kp": [200.0] * 29, "kd": [8.0] * 29}
    slow = write_contract(tmp_path / "s.yaml", control_hz=25, **about)
    engine = MujocoCpu(peer_model(read_contract(slow), "own", "own"), 1, 25.0, threads=1)
    ticks = list(roll_out_peer(Peer.load(blind[0], slow), MotionLibrary([nod(frames=21)], ()), engine))
    assert len(ticks) == 10 and all(bool(tick.running.all()) for tick in ticks), ".4 s are ten steps of 40 ms"


def test_ours_is_tried_as_the_baselines_are():
    clips, policy = [nod(frames=30)], load_policy(pretrained.FOLDER)
    mine = try_ours(policy, clips, threads=1).drop(columns="success_heading")
    pd.testing.assert_frame_equal(mine, follow(policy, Manner(policy.shape.seen), clips, load_model(physics_hz=200.0)))


def test_the_fourth_rule_forgives_place_and_heading_but_not_height():
    keys = torch.randn(1, 14, 3, generator=torch.Generator().manual_seed(0))
    turn, shift = turn_z(2.0)[None], torch.tensor([[3.0, -1.0, 0.0]])
    ref = reference(key_pos_w=keys)
    moved = rotate(turn[:, None].expand(-1, 14, -1), keys - ref.root_pos_w[:, None]) + (ref.root_pos_w + shift)[:, None]
    now = state(key_pos_w=moved, root_pos_w=ref.root_pos_w + shift, root_quat_w=multiply(turn, ref.root_quat_w))
    tick = Tick(now, ref, torch.ones(1, dtype=torch.bool), torch.zeros(1, dtype=torch.bool))
    assert turned_key_errors(tick).max() < 1e-5
    up = torch.tensor([[0.0, 0.0, 0.3]])
    high = state(key_pos_w=moved + up[:, None], root_pos_w=now.root_pos_w + up, root_quat_w=now.root_quat_w)
    assert torch.allclose(turned_key_errors(Tick(high, ref, tick.running, tick.unstable)), torch.tensor(0.3), atol=1e-5)


def test_pieces_of_a_motion_count_as_one_motion():
    row = {"success": True, "success_local": True, "success_heading": True, "success_upright": True}
    rows = pd.DataFrame([row | {"name": f"walk_p{i}", "mpjpe_rad": 0.1, "mpkpe_local_mm": 30.0} for i in range(9)])
    *_, line = table({"peer": rows})
    assert "| peer | 9 | 1.00 [0.21, 1.00] |" in line
    assert "pelvis: +0.00" in list(differences(rows, rows))[-1]


def test_the_command_prints_the_table_and_writes_the_trials(blind: tuple[Path, Path], tmp_path: Path, capsys):
    out = tmp_path / "trials.csv"
    words = [str(blind[0]), "embedded", "--limit", "1", "--pieces", "2", "--contract", str(blind[1])]
    assert cli.run(["evaluate", *words, "--model", "declared", "--against", "shipped", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "| made up (declared model, own gains) | 3 |" in said and "| shipped | 3 |" in said
    assert "less shipped, over motions:" in said and "evaluation contract " in said
    rows = pd.read_csv(out)
    assert rows.groupby("policy")["success_upright"].count().tolist() == [3, 3]


@pytest.mark.skipif(not TWIST2.exists(), reason="TWIST2's file is not part of this repository")
def test_twist2_follows_simple_motions_in_its_own_simulation_and_in_ours():
    clips = make_library(EmbeddedConfig(families=("squat", "walk"), limit=2))
    for model in ("own", "declared"):
        rows = try_peer(Peer.load(TWIST2, "twist2"), clips, Setting(model), threads=1)
        assert rows["success_upright"].all() and rows["mpjpe_rad"].mean() < 0.1
