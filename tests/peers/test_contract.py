"""A peer runs as its contract file says, or is refused in one line before anything runs."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml

from bumblebee import cli
from bumblebee.errors import BadInput
from bumblebee.peers import CONTRACTS
from bumblebee.peers.contract import Action, Block, PeerContract, Term, read_contract
from bumblebee.peers.policy import Peer
from bumblebee.peers.terms import TERMS
from bumblebee.robot.facts import joint_names
from tests.peers.peer import JOINTS, WIDTH, table, write_contract, write_onnx

TWIST2 = Path(__file__).parents[3] / "shared" / "data" / "peers" / "twist2" / "twist2_1017_20k.onnx"


def refused(*arguments: Any) -> str:
    with pytest.raises(BadInput) as caught:
        Peer.load(*arguments) if len(arguments) > 1 else read_contract(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_the_width_is_the_sum_of_the_blocks(tmp_path: Path):
    contract = read_contract(write_contract(tmp_path / "c.yaml"))
    assert (contract.width, contract.every_joint, contract.action.scale) == (WIDTH, True, (0.5,))


def test_without_wrists_it_is_a_policy_of_23_joints(tmp_path: Path):
    short = {name: table()[name][:23] for name in ("default_pos", "kp", "kd")}
    assert not read_contract(write_contract(tmp_path / "c.yaml", joints=list(joint_names()), **short)).every_joint


@pytest.mark.parametrize("field", ["robot", "name", "joints", "default_pos", "kp", "kd", "action", "groups", "input"])
def test_a_missing_field_is_named(tmp_path: Path, field: str):
    said = refused(write_contract(tmp_path / "c.yaml", **{field: None}))
    assert f"c.yaml: field {field}: expected a value, came no such field" in said and "docs/peers.md" in said


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"robot": "h1"}, "robot: expected g1, came 'h1'"),
        ({"joints": ["torso_joint", *JOINTS[1:]]}, "joints[0]: expected each joint of the G1 once, came torso_joint"),
        ({"joints": [*JOINTS[:28], JOINTS[0]]}, f"joints[28]: expected each joint of the G1 once, came {JOINTS[0]}"),
        ({"joints": list(JOINTS[:28])}, "joints: expected all of the G1's 23, came no left_hip_pitch_joint"),
        ({"kp": [100.0] * 28}, "kp: expected 29 numbers, one a joint, came 28"),
        ({"kd": [-1.0] * 29}, "kd[0]: expected a number from 0 to 100,000, came -1.0"),
        ({"kd": "soft"}, "kd: expected a list of numbers of 1 to 1,000, came 'soft'"),
        ({"armature": [0.01]}, "armature: expected 29 numbers"),
        ({"action": {"scale": [0.5, 0.5]}}, "action.scale: expected a number, or 29, came 2"),
        ({"action": {"scale": 0.5, "gain": 2}}, "action: field gain: expected a field among scale, clip"),
        ({"action": 0.5}, "action: expected fields and values, came 0.5"),
        ({"physics_hz": 120}, "physics_hz: expected a multiple of control_hz, 50, came 120"),
        ({"control_hz": 0}, "control_hz: expected a number from 1 to 1,000, came 0"),
        ({"groups": {"robot": [{"term": "joint_torque"}]}}, "groups.robot[0]: term: expected one of base_lin_vel"),
        ({"groups": {"robot": [{"term": "joint_pos", "axes": "xy"}]}}, "groups.robot[0]: axes: expected none"),
        (
            {"groups": {"robot": [{"term": "roll_pitch", "zero": ["knee"]}]}},
            "groups.robot[0]: zero: expected joints of",
        ),
        ({"groups": {"robot": []}}, "groups.robot: expected a list, came []"),
        ({"input": [{"groups": ["robot", "camera"]}]}, "input[0]: groups: expected groups among motion, robot"),
        ({"input": [{"groups": ["robot"], "now": False}]}, "input[0]: expected now, or past steps, came neither"),
        ({"input": [{"groups": ["robot"], "order": "mixed"}]}, "input[0]: order: expected one of oldest_first"),
    ],
)
def test_a_false_field_is_named(tmp_path: Path, changes: dict, said: str):
    assert said in refused(write_contract(tmp_path / "c.yaml", **changes))


@pytest.mark.parametrize("content", ["", "[1, 2]", "robot: [", "1: 2"])
def test_a_file_that_is_no_contract_is_one_line(tmp_path: Path, content: str):
    (tmp_path / "c.yaml").write_text(content)
    assert "c.yaml" in refused(tmp_path / "c.yaml")


def test_an_onnx_of_another_width_is_refused_and_the_width_is_said(tmp_path: Path):
    said = refused(write_onnx(tmp_path / "p.onnx", width=WIDTH - 1), write_contract(tmp_path / "c.yaml"))
    assert f"p.onnx: inputs: expected one of shape (N, {WIDTH}), as the contract's, came" in said
    assert str(WIDTH - 1) in said and "another robot's" in said


def test_an_onnx_with_another_number_of_outputs_is_refused(tmp_path: Path):
    said = refused(write_onnx(tmp_path / "p.onnx", joints=19), write_contract(tmp_path / "c.yaml"))
    assert "p.onnx: outputs: expected (N, 29)" in said and "(2, 19)" in said


def test_an_onnx_that_answers_no_numbers_is_refused(tmp_path: Path):
    broken = write_onnx(tmp_path / "p.onnx", weight=np.full((WIDTH, 29), np.inf))
    assert "finite numbers" in refused(broken, write_contract(tmp_path / "c.yaml"))


def test_what_is_no_onnx_or_another_file_than_described_is_refused(tmp_path: Path):
    (tmp_path / "p.onnx").write_text("no model")
    assert "an ONNX model" in refused(tmp_path / "p.onnx", write_contract(tmp_path / "c.yaml"))
    other = write_contract(tmp_path / "c.yaml", onnx_sha256="0" * 64)
    assert "p.onnx: sha256: expected 000000000000" in refused(write_onnx(tmp_path / "p.onnx"), other)


def test_a_file_for_one_robot_at_a_time_is_asked_row_by_row(tmp_path: Path):
    weight = np.random.default_rng(0).standard_normal((WIDTH, 29))
    contract, rows = write_contract(tmp_path / "c.yaml"), torch.rand(3, WIDTH)
    many = Peer.load(write_onnx(tmp_path / "n.onnx", weight=weight), contract).act(rows)
    one = Peer.load(write_onnx(tmp_path / "1.onnx", weight=weight, n=1), contract).act(rows)
    assert one.shape == (3, 29) and torch.allclose(one, many, atol=1e-4)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--contract", "nosuch.yaml"], "nosuch.yaml: expected a contract file, or one that comes along: twist2"),
        ([], "p.onnx: expected --contract FILE, which describes it, came none"),
        (["--contract", "C", "--gains", "ours"], "--gains: expected own or declared, came 'ours'"),
        (["--contract", "C", "--noise", "1"], "--noise: expected no such option here, came 1.0. It is for our own"),
        (["--contract", "C", "--against", "nosuch"], "nosuch: expected a trained policy"),
    ],
)
def test_the_command_refuses_in_one_line(tmp_path: Path, words: list[str], said: str, capsys, monkeypatch):
    write_onnx(tmp_path / "p.onnx")
    words = [str(write_contract(tmp_path / "c.yaml")) if word == "C" else word for word in words]
    monkeypatch.setattr("sys.argv", ["bumblebee", "evaluate", str(tmp_path / "p.onnx"), "embedded", *words])
    with pytest.raises(SystemExit) as end:
        cli.main()
    told = capsys.readouterr()
    assert end.value.code == 2 and said in told.err and told.err.count("\n") == 1 and not told.out


def test_options_of_a_peer_are_refused_for_our_own_policies(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["bumblebee", "evaluate", "shipped", "--gains", "own"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 2 and "--gains: expected no such option here" in capsys.readouterr().err


@pytest.mark.parametrize("name", CONTRACTS)
def test_contracts_that_come_along_can_be_read_and_name_their_file(name: str):
    assert read_contract(name).onnx_sha256 and yaml.safe_load(CONTRACTS[name].read_text())


def test_the_page_explains_every_field_and_term():
    page = (Path(__file__).parents[2] / "docs" / "peers.md").read_text()
    names = [*TERMS, *(field.name for kind in (PeerContract, Action, Block, Term) for field in fields(kind))]
    assert [name for name in names if f"`{name}`" not in page] == []


def test_twist2_takes_1432_values():
    assert read_contract("twist2").width == 1432 == 127 + 10 * 127 + 35


@pytest.mark.skipif(not TWIST2.exists(), reason="TWIST2's file is not part of this repository")
def test_twist2s_published_file_is_the_one_that_its_contract_describes():
    assert Peer.load(TWIST2, "twist2").act(torch.zeros(3, 1432)).shape == (3, 29)
