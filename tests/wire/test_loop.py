"""The loop closes over the wire: what the robot undeclared has, and the wire's own latency, explain its log."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.replay import replay
from bumblebee.measured.rollout import write_rollout
from bumblebee.robot.model import write_xml
from bumblebee.sim.effects import Effect
from bumblebee.wire.journal import layout, record
from bumblebee.wire.links.line import LineFaults
from bumblebee.wire.rehearsal import Rehearsal
from bumblebee.wire.rollouts import latency, rollout_of
from tests.policy.test_stand_in_robots import effect
from tests.wire.test_journal import G1

KNEE = "left_knee_joint"


def test_sealed_friction_and_the_wires_latency_explain_what_the_declared_model_does_not(
    rehearsal: Callable[..., Rehearsal], tmp_path: Path
) -> None:
    """Joint error after 0.2 s, of the declared model, with the friction, and with the latency that stamps tell."""
    for seed in range(2):
        line = LineFaults(delay=0.004)
        run = rehearsal([effect("coulomb_friction", KNEE, 4.0)], 60, seed=seed, states=line, orders=line)
        rows = np.frombuffer(b"".join(record(entry, 23) for entry in run.entries()), layout(23))
        late = latency(rows)
        assert run.guard.reason == "" and late is not None and late.median > 0.012
        write_rollout(tmp_path / "rollouts" / f"nod-{seed}.parquet", rollout_of(G1 | {"id": f"nod-{seed}"}, rows))
    write_xml(tmp_path / "model.xml")
    session = open_session(tmp_path / "model.xml", tmp_path)
    friction = Effect("coulomb_friction", (KNEE,), {"frictionloss": 4.0})
    delay = Effect("command_delay", (), {"delay": late.median})
    errors = [
        replay(session, effects)["0.2"]["joint_pos_rmse"]["value"] for effects in ([], [friction], [friction, delay])
    ]
    assert errors[2] < 0.7 * errors[1] and errors[2] < 0.7 * errors[0], errors
