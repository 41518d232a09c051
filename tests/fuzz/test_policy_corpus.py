"""Each bad policy folder of the corpus is refused in one line, before anything of it moves a robot."""

from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.policy.exported import ExportedPolicy
from tests.fuzz.corpora.policy_corpus import POLICIES, stated
from tests.fuzz.motion_files import policy


def test_the_good_one_is_loaded(tmp_path: Path) -> None:
    assert ExportedPolicy.load(policy(tmp_path / "policy")).scale.shape == (23,)


@pytest.mark.parametrize("name", POLICIES)
def test_a_bad_policy_folder_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    folder = policy(tmp_path / "policy")
    POLICIES[name](folder)
    with pytest.raises(BadInput) as caught:
        ExportedPolicy.load(folder)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 800


def test_a_contract_of_another_robot_is_refused_whatever_its_joints(tmp_path: Path) -> None:
    folder = policy(tmp_path / "policy")
    stated("robot", "h1")(folder)
    with pytest.raises(BadInput, match=r"contract.json: robot: expected 'g1_23dof', came 'h1'"):
        ExportedPolicy.load(folder)
    stated("robot", "g1_23dof")(folder)
    ExportedPolicy.load(folder)


def test_a_contract_with_a_key_twice_is_refused(tmp_path: Path) -> None:
    folder = policy(tmp_path / "policy")
    file = folder / "contract.json"
    file.write_text(file.read_text().replace("{", '{"control_hz": 200, ', 1))
    with pytest.raises(
        BadInput, match=r"contract.json: expected JSON with each key once, came the key 'control_hz' twice"
    ):
        ExportedPolicy.load(folder)
