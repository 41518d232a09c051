"""Refinement, and its controls: the same settings and parent, without the diagnosis."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
import yaml

from bumblebee.learning.delta import DeltaAction, DeltaConfig, Gain, make_network
from bumblebee.motion.store import write_library
from bumblebee.robot.model import write_xml
from bumblebee.sim.effects import Effect, single, write_effects
from bumblebee.sim.sensors import load_model
from tasks import base, control, experts, refine
from tasks.delta import Trained
from tasks.policies import training
from tasks.refine import RefineConfig
from tasks.settings.params import load
from tests.tracking.clips import waving

TINY = {
    "env": {"num_worlds": 4, "threads": 1},
    "ppo": {"iterations": 2, "steps": 2, "hidden": [8], "epochs": 1, "mini_batches": 1},
}


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One cluster's expert and a diagnosis that says the robot is another one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(training, "log_run", lambda *args, **kwargs: None)
    write_library(Path("data/filtered"), [waving(name, 20) for name in "ab"], None)
    Path("data/clusters").mkdir(parents=True)
    pd.DataFrame({"name": list("ab"), "cluster": ["c0", "c0"]}).to_parquet("data/clusters/labels.parquet")
    content = {"clusters": ["c0"], "rounds": [{"n": 1, "parent": 0}], "final_round": 1, "delta": {}, "control": {}}
    content |= {"base": TINY | {"init": "scratch"}, "experts": TINY, "refine": TINY | {"seed": 5}}
    Path("params.yaml").write_text(yaml.safe_dump(content))
    base.main()
    experts.main("c0")
    return tmp_path


def test_a_control_is_the_same_training_of_the_same_expert_in_the_declared_model(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []
    monkeypatch.setattr(control, "train_policy", lambda job, config: seen.append((job, config)))
    control.main(1, "c0", "declared")
    ((job, config),) = seen
    assert (job.parent, job.model, job.world.hooks, job.world.action_adapter) == (
        Path("models/experts/r0/c0"), None, None, None,
    )  # fmt: skip
    assert config == load("refine", RefineConfig) and config.seed == 5
    declared = load_model(physics_hz=config.env.physics_hz)
    assert np.array_equal(job.world.model.body_mass, declared.body_mass)
    assert np.array_equal(job.world.model.actuator_biasprm, declared.actuator_biasprm)


def test_it_writes_a_policy_whose_card_names_parent_and_steps(workspace: Path) -> None:
    control.main(1, "c0", "declared")
    card = json.loads(Path("models/control/r1/c0/declared/policy/card.json").read_text())
    assert card["parent"] == "models/experts/r0/c0" and card["iterations"] == 2 and card["config"]["seed"] == 5


def test_delta_alone_is_used_though_it_beats_nothing(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    network = make_network((4,), 4)
    with torch.no_grad():
        network[-1].bias += 0.1
    delta = DeltaAction(network, DeltaConfig().joints, 0.2)
    made = Trained(delta, pd.DataFrame({"iteration": [1]}), Gain(2, 1, {}, False, "no better"), ("r",), {})
    Path("data/measured/r1").mkdir(parents=True)
    write_xml(Path("data/measured/r1/model.xml"))
    monkeypatch.setattr(control, "train", lambda *_: made)
    seen = []
    monkeypatch.setattr(control, "train_policy", lambda job, config: seen.append(job))
    control.main(1, "c0", "delta")
    assert seen[0].world.action_adapter is not None and seen[0].model is None
    card = json.loads(Path("models/control/r1/c0/delta/action/card.json").read_text())
    assert card["promoted"] is False


def diagnosed(effects: list[Effect]) -> None:
    """A round's diagnosis with these effects, and a delta action that was not kept."""
    Path("data/diagnosis/r1").mkdir(parents=True)
    Path("models/delta/r1/c0").mkdir(parents=True)
    write_effects(Path("data/diagnosis/r1/effects.yaml"), effects)
    write_xml(Path("data/diagnosis/r1/model.xml"))
    Path("models/delta/r1/c0/card.json").write_text('{"promoted": false}')


def test_where_nothing_was_found_the_expert_stays_to_the_byte_and_its_card_says_so(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    diagnosed([])
    monkeypatch.setattr(refine, "train_policy", lambda *_: pytest.fail("nothing is to be learned"))
    refine.main(1, "c0")
    before, after = Path("models/experts/r0/c0"), Path("models/experts/r1/c0")
    for name in ("policy.onnx", "policy.pt", "contract.json"):
        assert (after / name).read_bytes() == (before / name).read_bytes()
    card = json.loads((after / "card.json").read_text())
    assert (card["round"], card["kept"], card["iterations"], card["parent"]) == (1, "parent", 0, str(before))
    assert not (after / "curve.csv").exists()


def test_where_an_effect_was_found_the_expert_is_trained_in_the_corrected_model(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    diagnosed([single("encoder_offset", "left_knee_joint", 0.05)])
    seen = []
    monkeypatch.setattr(refine, "train_policy", lambda job, config: seen.append(job))
    refine.main(1, "c0")
    assert seen[0].model == Path("data/diagnosis/r1/model.xml") and seen[0].world.hooks.encoder_offset.any()


def test_without_a_long_enough_rollout_the_control_has_no_delta_and_says_so(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(control, "declared", lambda _: None)
    monkeypatch.setattr(control, "train", lambda *_: None)
    assert control.delta_alone(1, "c0", Path("x")) is None
    assert "has none" in capsys.readouterr().out and not Path("x").exists()
