"""The input of a peer beside one that is put together by hand, in numpy, from the same quantities."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.peers.contract import read_contract
from bumblebee.peers.observer import Observer
from bumblebee.peers.terms import TERMS, Seen
from bumblebee.sim.rotations import from_rotation_vector, multiply
from tests.benchmarks.others.steps import reference, state
from tests.peers.peer import ANKLE, JOINTS, WIDTH, write_contract

N, J, STEPS = 2, 29, 4


def robots(generator: torch.Generator):
    """Robots with random joints and turning rates."""
    draws = {name: torch.randn(N, J, generator=generator) for name in ("joint_pos", "joint_vel")}
    return state(N, root_ang_vel_b=torch.randn(N, 3, generator=generator), **draws)


def test_blocks_order_history_and_scales_are_the_contracts(tmp_path: Path):
    """Oldest first without now from zeros; newest first with now, by term, from the first step."""
    observer = Observer(read_contract(write_contract(tmp_path / "c.yaml")))
    generator = torch.Generator().manual_seed(0)
    seen, moved = [], []
    shown = np.array([joint != ANKLE for joint in JOINTS])
    for step in range(STEPS):
        now, last = robots(generator), torch.randn(N, J, generator=generator)
        ahead = {k: torch.full((N, J), 10.0 * step + k) for k in (1, 2)}
        speed = torch.tensor([[step + 0.5, -1.0, 9.0]]).repeat(N, 1)
        got = observer.see(now, lambda k: reference(N, joint_pos=ahead[k], root_lin_vel_w=speed), last).numpy()  # noqa: B023
        parts = (0.25 * now.root_ang_vel_b.numpy(), 0.05 * now.joint_vel.numpy() * shown, last.numpy())
        seen.append(parts)
        moved.append(np.concatenate((speed[:, :2].numpy(), ahead[2].numpy()), axis=1))
        both = [np.concatenate((*s, m), axis=1) for s, m in zip(seen, moved, strict=True)]
        past = [np.zeros_like(both[0]), np.zeros_like(both[0]), *both[:-1]][-2:]
        before = seen[-2] if step else seen[-1]
        terms = [np.concatenate((one, other), axis=1) for one, other in zip(parts, before, strict=True)]
        wanted = np.concatenate((moved[-1], *past, *terms), axis=1)
        assert got.shape == (N, WIDTH) and np.allclose(got, wanted, atol=1e-6)


def value(name: str, now=None, ref=None) -> list[float]:
    """A term of one robot with 23 joints whose default is .1 rad."""
    seen = Seen(now or state(), ref or reference(), torch.zeros(1, 23), torch.full((23,), 0.1))
    return [round(float(v), 5) for v in TERMS[name].value(seen)[0]]


@pytest.mark.parametrize("name", TERMS)
def test_a_term_has_the_size_that_the_table_says(name: str):
    assert len(value(name)) == (TERMS[name].size or 23)


def test_terms_by_hand():
    lean = from_rotation_vector(torch.tensor([[0.2, 0.0, 0.0]]))
    left = from_rotation_vector(torch.tensor([[0.0, 0.0, torch.pi / 2]]))
    quat = multiply(left, lean)
    now, ref = state(root_quat_w=quat), reference(root_quat_w=quat)
    assert value("roll_pitch", now) == value("reference_roll_pitch", ref=ref) == [0.2, 0.0]
    down = [0.0, round(-np.sin(0.2), 5), round(-np.cos(0.2), 5)]
    assert value("projected_gravity", now) == value("reference_projected_gravity", ref=ref) == down
    forward = reference(root_quat_w=left, root_lin_vel_w=torch.tensor([[0.0, 2.0, 0.0]]))
    assert value("reference_lin_vel", ref=forward) == [2.0, 0.0, 0.0], "in the reference's own frame"
    assert value("base_height") == value("reference_height") == [0.8]
    bent = replace(reference(), joint_pos=torch.ones(1, 23))
    assert value("joint_pos") == [-0.1] * 23 and value("reference_joint_pos", ref=bent) == [1.0] * 23
    assert value("reference_joint_pos_from_default", ref=bent) == [0.9] * 23


def test_twist2s_input_is_the_one_that_its_server_builds():
    """127 now, the ten steps before from zeros with the oldest first, and the reference's 35 again."""
    contract = read_contract("twist2")
    observer, generator = Observer(contract), torch.Generator().manual_seed(1)
    default = np.array(contract.default_pos, np.float32)
    moving = np.array(["ankle" not in joint for joint in contract.joints])
    past = [np.zeros((N, 127), np.float32)] * 10
    for _ in range(12):
        lean = from_rotation_vector(torch.tensor([[0.1, 0.0, 0.0], [0.0, -0.3, 0.0]]))
        now, last = replace(robots(generator), root_quat_w=lean), torch.randn(N, J, generator=generator)
        wanted = torch.randn(N, J + 6, generator=generator)
        ref = reference(N, joint_pos=wanted[:, 6:], root_lin_vel_w=wanted[:, :3], root_ang_vel_b=wanted[:, 3:6])
        command = (wanted[:, :2], torch.full((N, 1), 0.8), torch.zeros(N, 2), wanted[:, 5:6], wanted[:, 6:])
        speed = 0.05 * now.joint_vel.numpy() * moving
        body = (
            0.25 * now.root_ang_vel_b,
            torch.tensor([[0.1, 0.0], [0.0, -0.3]]),
            now.joint_pos - default,
            speed,
            last,
        )
        row = np.concatenate((*command, *body), axis=1)
        got = observer.see(now, lambda step: ref if step == 1 else None, last).numpy()  # noqa: B023
        assert got.shape == (N, 1432)
        assert np.allclose(got, np.concatenate((row, *past, row[:, :35]), axis=1), atol=1e-5)
        past = [*past[1:], row]
