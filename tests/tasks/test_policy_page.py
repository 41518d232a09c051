"""docs/policy.md, as a user would follow it: the policy comes out of the registry and its examples run."""

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import onnx
import pytest
import yaml

from bumblebee import cli
from bumblebee.compensation.file import write_compensation
from bumblebee.compensation.plan import compensate
from bumblebee.errors import EXIT_BAD_INPUT
from bumblebee.motion.store import write_library
from bumblebee.policy.exported import ExportedPolicy
from tasks import registry
from tasks.policies import fetch
from tasks.registry.models import _policy_files
from tests.commands.test_commands import run
from tests.policy.conftest import nod, policy_folder

PAGE = Path(__file__).parents[2] / "docs" / "policy.md"
CARD = "# expert-c0\n\nFollows a reference motion.\n"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two versions of expert-c0, the second of them champion, and two clips."""
    folder = tmp_path_factory.mktemp("page") / "lab"
    folder.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        make = policy_folder.__wrapped__(folder)
        for gain in (0.0, 0.01):
            made = make(f"p{gain}", gain)
            (made / "card.json").write_text(json.dumps({"config": {"seed": 7}}))
            tags = {
                "onnx_sha256": ExportedPolicy.load(made).sha256,
                "evaluation_contract": "c",
                "dvc_policy": str(gain),
            }
            version = registry.register("expert-c0", made, tags, {"success": 1.0}, CARD)
        registry.set_alias("expert-c0", "champion", version)
        registry.describe("expert-c0", CARD)
        write_library(folder / "data" / "filtered", [nod(), nod("other", 30)])
    return folder


@pytest.fixture
def fetched(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(workspace)
    if not Path("policy").exists():
        first = re.findall(r"^    bumblebee (.+)$", PAGE.read_text(), re.MULTILINE)[0]
        assert cli.run(shlex.split(first)) == 0
    return workspace / "policy"


def test_a_champion_is_fetched_without_a_server_with_all_that_belongs_to_it(workspace: Path, fetched: Path) -> None:
    assert (fetched / "policy.onnx").read_bytes() == (workspace / "p0.01" / "policy.onnx").read_bytes()
    assert (fetched / "README.md").read_text() == CARD
    lineage = json.loads((fetched / "lineage.json").read_text())
    assert lineage["seed"] == "7" and {"commit", "dirty"} == set(lineage["code"])
    assert {"python", "torch", "mujoco", "rsl-rl-lib"} <= set(lineage["versions"])
    ExportedPolicy.load(fetched)


def test_the_examples_of_the_page_run_as_they_stand(fetched: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And MLflow's model gives the numbers of ONNX Runtime on the exported file, within its signature."""
    code = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    served = next(block for block in code if "mlflow" in block)
    local = [block for block in code if block is not served]
    assert len(local) == 3
    write_compensation(Path("compensation.json"), compensate([]))
    scope: dict = {}
    for block in local:
        exec(block, scope)
    assert "nod: 20 of 20 control steps" in capsys.readouterr().out
    registry.prepare()  # in place of the server's address: the same store
    exec(re.sub(r"mlflow\.set_tracking_uri\(.*\)", "", served), scope)
    assert "obs" in capsys.readouterr().out
    expected = scope["policy"].act(scope["obs"])
    assert np.array_equal(scope["actions"], expected) and np.abs(expected).max() > 0
    assert scope["contract"] == scope["policy"].contract
    ends = scope["loaded"].metadata.signature
    assert [(end.name, end.shape, str(end.type)) for end in (*ends.inputs.inputs, *ends.outputs.inputs)] == [
        ("obs", (-1, scope["obs"].shape[1]), "float32"),
        ("actions", (-1, 23), "float32"),
    ]
    assert (Path(scope["folder"]) / "policy.onnx").read_bytes() == (fetched / "policy.onnx").read_bytes()
    client = registry.prepare()
    assert client.get_model_version_by_alias("expert-c0", "champion").description == CARD
    assert client.get_registered_model("expert-c0").description == CARD


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["expert-c9@champion", "--out", "x"], "expert-c0"),
        (["expert-c0@nobody", "--out", "x"], "a version in this workspace's registry"),
        (["expert-c0", "--out", "x"], "<name>@<alias>"),
        (["expert-c0/1", "--out", "data"], "a new folder"),
        (
            ["expert-c0/1", "--out", "x", "--workspace", "data"],
            "registry, came no file. No loop has run there",
        ),
        (["expert-c0/1", "--out", "x", "--workspace", "nowhere"], "a workspace, came no folder. No loop has run there"),
    ],
)
def test_what_cannot_be_fetched_is_refused_in_one_line_and_nothing_is_written(
    workspace: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(workspace)
    before = sorted(path.name for path in workspace.iterdir())
    assert fetch.main(arguments) == EXIT_BAD_INPUT
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert sorted(path.name for path in workspace.iterdir()) == before and not (workspace / "data/.servers").exists()


def test_what_people_were_asked_about_and_have_not_approved_is_not_copied(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(workspace)
    asked = ["expert-c0@champion", "--approved", "--out", "asked"]
    assert fetch.main(asked) == 0 and "no person was asked about it" in capsys.readouterr().out
    shutil.rmtree("asked")
    question = Path("data/approvals/promotion-expert-c0.json")
    question.parent.mkdir()
    question.write_text("{}")
    assert fetch.main(asked) == EXIT_BAD_INPUT
    said = capsys.readouterr()
    assert "an approval by people of this file, came no answer" in said.err and said.out == ""
    assert not Path("asked").exists()
    shutil.rmtree(question.parent)
    assert fetch.main([*asked, "--server", "http://127.0.0.1:5000"]) == EXIT_BAD_INPUT
    assert "--approved: expected a workspace" in capsys.readouterr().err


def test_a_champion_is_deployed_by_its_name_as_far_as_the_robot(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """It is fetched, its contract read, and the wire looked at, where nobody is; from any folder, nothing is left."""
    monkeypatch.setattr("bumblebee.wire.safety.preflight._PATIENCE", 0.05)
    monkeypatch.chdir(tmp_path)
    words = ["deploy", "run", "expert-c0@champion", "--workspace", str(workspace), "--clip", "squat", "--unattended"]
    assert run(*words, "--at", tmp_path / "w") == EXIT_BAD_INPUT
    said = capsys.readouterr()
    assert "no person was asked about it" in said.out and "came nothing" in said.err
    assert [path.name for path in tmp_path.iterdir()] == ["w"]


def test_a_version_from_before_cards_is_fetched_too(workspace: Path, tmp_path: Path) -> None:
    """Its files are MLflow's model alone, with the contract among its metadata."""
    stored = onnx.load(workspace / "p0.01" / "policy.onnx")
    stored.producer_name = "written anew"
    path = str(tmp_path / "model.onnx")
    onnx.save_model(stored, path, save_as_external_data=True, location="weights.data", size_threshold=0)
    exported = ExportedPolicy.load(workspace / "p0.01")
    (tmp_path / "MLmodel").write_text(yaml.safe_dump({"metadata": {"contract": exported.contract}}))
    policy = ExportedPolicy.load(_policy_files(tmp_path))
    obs = np.ones((2, 283), np.float32)
    assert np.array_equal(policy.act(obs), exported.act(obs))
    assert policy.contract["exported_onnx_sha256"] == exported.sha256 != policy.sha256
