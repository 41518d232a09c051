"""`import bumblebee as bb`: the names are there, the examples run, wrong arguments are one line with shapes."""

import doctest
import json
import re
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

import bumblebee as bb
from bumblebee import cli
from bumblebee.api import training
from bumblebee.api.learnt import learnt_before
from bumblebee.api.policy_card import splits, tried
from bumblebee.api.recipes import as_seen_by
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.pieces import hold_out
from bumblebee.tracking.config import EnvConfig
from tests.policy.conftest import nod

PAGE = Path(__file__).parents[2] / "docs" / "api.md"
T = 4
UPRIGHT = np.tile([1, 0, 0, 0], (T, 1))
GOOD = {"root_pos": np.tile([0, 0, 0.76], (T, 1)), "root_quat": UPRIGHT, "joint_pos": np.zeros((T, 23))}
FILES = {"policy.pt", "policy.onnx", "contract.json", "card.json", "README.md", "curve.csv", "trials.csv", "film.gif"}


@pytest.fixture(autouse=True)
def quick(tmp_path, monkeypatch):
    """Work in a folder of its own; embedded motions are made once, films painted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("bumblebee.report.films.playback.render_frames", lambda *rest: (None, "not here"))
    monkeypatch.setattr("bumblebee.motion.embedded.make_library", lambda config: STAND[: config.limit])


def short(clip):
    """Its first 1.2 s."""
    arrays = {name: getattr(clip, name)[:60] for name in ("root_pos", "root_quat", "joint_pos", "key_pos")}
    return replace(clip, **arrays)


STAND = [short(clip) for clip in make_library(EmbeddedConfig(families=("stand",), limit=2))]


def test_the_examples_of_the_page_run():
    scope: dict = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S):
        exec(block, scope)
    assert {path.name for path in Path("policy").iterdir()} == FILES
    assert re.fullmatch(
        r"<policy in policy: \d of 2 motions followed(; the initial policy was kept)?>", repr(scope["made"])
    )
    card = json.loads(Path("policy/card.json").read_text())
    assert (card["parent"], card["learner"]) == ("shipped", "ppo")
    assert "- learner: ppo\n" in Path("policy/README.md").read_text()
    assert [path.name for path in Path().glob(".*")] == []  # checkpoints are gone
    assert bb.load_policy("policy").shape.actions == 23


@pytest.mark.parametrize("room", ["motions", "policies"])
def test_the_examples_of_the_docstrings_run(room):
    assert doctest.testmod(import_module(f"bumblebee.api.{room}")).failed == 0


def test_every_name_that_is_offered_is_there_and_on_the_page():
    for name in bb.__all__:
        assert getattr(bb, name) and name in dir(bb)
    for path in re.findall(r"^::: bumblebee\.(\S+)", PAGE.read_text(), re.M):
        module, _, name = path.rpartition(".")
        assert getattr(import_module(f"bumblebee.{module}"), name).__doc__


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joint_pos": np.zeros((T, 29))}, "joint_pos: expected an array (T, 23) of numbers, came shape (4, 29)"),
        ({"root_quat": np.zeros((T, 4))}, "root_quat: expected quaternions that are not zero"),
        ({"root_pos": np.full((T, 3), np.nan)}, "root_pos: expected finite numbers, came 12"),
        ({"root_pos": np.zeros((T + 1, 3))}, "expected one length T of at least 1, came lengths [5, 4, 4]"),
        ({"root_pos": "x"}, "root_pos: expected an array (T, 3) of numbers, came str"),
    ],
)
def test_an_array_of_a_wrong_shape_is_one_line_with_both_shapes(change, said):
    with pytest.raises(bb.BadInput) as caught:
        bb.make_motion("m", 50, **(GOOD | change))
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_wrong_arguments_are_one_line_with_what_to_do():
    for call, said in (
        (lambda: bb.evaluate("shipped", "folder"), "bumblebee.read_motions(path)"),
        (lambda: bb.evaluate("shipped", []), "an empty list"),
        (lambda: bb.gap("dataset"), "bumblebee.open_dataset(model, dataset)"),
        (lambda: bb.read_motions("embedded", speed=2), "'speed'"),
        (lambda: bb.train([nod()], "p", minutes=-1), "TrainConfig.minutes"),
        (lambda: bb.train([nod()], "p", hours=1), "'hours'"),
        (lambda: bb.retarget(np.zeros((9, 17, 3)), 50), "(T, 18, 3) of numbers, came shape (9, 17, 3)"),
        (lambda: bb.load_policy("nowhere"), "a trained policy"),
    ):
        with pytest.raises(bb.BadInput, match=re.escape(said)):
            call()
    assert not Path("p").exists()


def test_a_child_sees_what_its_parent_sees_and_is_compared_where_it_can_know_it_is():
    here, there = (as_seen_by(EnvConfig(), bb.load_policy(name).shape) for name in ("shipped", "imu"))
    assert here == EnvConfig()
    assert there.observation.terms == ("imu",) and there.ahead == (0.1, 0.3, 0.6, 1.0) and there.place == "own"


def test_a_child_names_the_licences_of_all_its_parents_and_calls_nothing_unseen(tmp_path):
    own, child = learnt_before("shipped"), tmp_path / "policy"
    assert "CC BY 4.0" in own[0] and "MIT" in own[0]
    child.mkdir()
    (child / "card.json").write_text(json.dumps({"licences": {"CC-BY-NC-4.0": 3}, "learnt_before": own}))
    assert learnt_before(str(child)) == [*own, f"`{child}`: CC-BY-NC-4.0 (3)"]
    assert "licences unknown" in learnt_before(str(tmp_path))[0] and learnt_before("nothing") == []
    for text, said in (('["x"]', "a policy's card"), ('{"licences": 3}', "a policy's card"), ("{", "card.json")):
        (child / "card.json").write_text(text)
        with pytest.raises(bb.BadInput, match=re.escape(said)):
            bb.train([nod()], tmp_path / "never", start=str(child))
    assert not (tmp_path / "never").exists()
    assert splits(None)["test"] == "held out" and "may have learnt them" in splits(child)["test"]


def test_an_evaluation_says_how_much_noise_there_was():
    table = pd.DataFrame(
        {"name": ["a"], "split": ["train"], "success": [True], "key_error": [0.1], "joint_error": [0.2]}
    )
    assert next(tried(table)).endswith("without noise:")
    assert next(tried(table, noise=0.5)).endswith("with 0.5 times the noise of training:")


def test_ppo_from_a_policy_without_a_critic_lets_the_value_learn_first(tmp_path):
    learner = training.make_learner(hold_out(STAND, 0.0), training.TrainConfig(start="imu", worlds=8), tmp_path)
    before = {name: value.clone() for name, value in learner.algorithm.actor.state_dict().items()}
    learner.train("policy", lambda: learner.iteration >= 1)
    weights = [name for name in before if name.endswith("weight")]
    assert weights and learner.config.value_first > 1
    assert all(torch.equal(before[name], learner.algorithm.actor.state_dict()[name]) for name in weights)


def test_a_training_that_cannot_be_is_refused_before_motions_are_read(monkeypatch):
    monkeypatch.setattr("bumblebee.motion.reading.folder.read_folder", lambda *rest, **more: pytest.fail("read"))
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    Path("motions").mkdir()
    with pytest.raises(bb.BadInput, match=r"engine mujoco_warp: expected (the packages|an NVIDIA GPU)"):
        cli.run(["train", "motions", "--gpu"])
    for taken, said in (("policy", "came something else"), ("policy/card.json", "training is finished. --overwrite")):
        Path(taken).mkdir()
        with pytest.raises(bb.BadInput, match=said):
            cli.run(["train", "motions"])
        with pytest.raises(bb.BadInput, match=said):
            bb.train(STAND, "policy")
    with pytest.raises(pytest.fail.Exception, match="read"):
        cli.run(["train", "motions", "--overwrite"])


def test_a_training_that_is_stopped_before_its_first_checkpoint_says_so(monkeypatch):
    told: list[str] = []
    monkeypatch.setattr(training, "train_for", lambda *rest: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        bb.train(STAND, "policy", minutes=0.005, worlds=8, say=told.append)
    assert told[-1] == "no checkpoint yet; the same command begins anew"
    assert "none is held out" in told[1] and "it takes 4 motions of one kind" in told[1]


def test_a_training_that_was_killed_goes_on(monkeypatch):
    """Stopped after its training, the same call neither trains again nor starts over."""
    monkeypatch.setattr(training, "_kept", lambda *rest: (_ for _ in ()).throw(KeyboardInterrupt))
    told: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        bb.train(STAND, "policy", minutes=0.005, worlds=8, say=told.append)
    place = Path(".policy.training").absolute()
    assert told[-1] == f"the last checkpoint is kept in {place}; the same command goes on from it"
    iterations = []
    monkeypatch.setattr(training, "_kept", lambda learner, *rest: iterations.append(learner.iteration))
    monkeypatch.setattr("bumblebee.learning.ppo.learner.Trainer._iterate", lambda self: pytest.fail("trained again"))
    bb.train(STAND, "policy", minutes=0.005, worlds=8)
    assert iterations[0] >= 1 and not Path(".policy.training").exists()


def test_the_time_left_of_a_training_follows_from_its_minutes(monkeypatch, capsys):
    monkeypatch.setattr("bumblebee.progress.LINE_EVERY", 0.0)
    bb.train(STAND, "policy", minutes=0.05, worlds=8)
    told = capsys.readouterr().out
    assert re.search(r"^train speed: \d+/3 s \(\d+ %\), 0:0\d left, [\d.,]+ frames/s, key error", told, re.M)


@dataclass(frozen=True)
class Ends:
    iterations: int = 0


class Hastens:
    """A learner whose iterations get faster: by the first ones, fewer would do."""

    def __init__(self) -> None:
        self.config, self.iteration, self._seconds, self.saved = Ends(), 0, 0.0, []

    def train(self, what, enough):
        last = self.config.iterations
        while self.iteration < last and not enough():
            self._seconds += 1.0 if self.iteration < 4 else 0.125
            self.iteration += 1

    def save_checkpoint(self):
        self.saved.append(self._seconds)


def test_a_training_takes_the_time_that_it_was_given_however_fast_it_becomes(monkeypatch):
    learner = Hastens()
    monkeypatch.setattr(training, "_CHECKPOINT", 8.0)
    training.train_for(learner, 20.0)
    assert learner._seconds == 20.0 and learner.saved == [8.0, 16.0, 20.0]
    training.train_for(learner, 20.0)  # killed after its end, it has nothing left to do
    assert learner._seconds == 20.0
