"""Each bad policy folder of the corpus is refused in one line, before anything of it moves a robot."""

from pathlib import Path

import pytest

from bumblebee.deploy.policy import ExportedPolicy
from bumblebee.errors import BadInput
from tests.fuzz.motion_files import policy
from tests.fuzz.policy_corpus import POLICIES


def test_the_good_one_is_loaded(tmp_path: Path) -> None:
    assert ExportedPolicy.load(policy(tmp_path / "policy")).scale.shape == (23,)


@pytest.mark.parametrize("name", POLICIES)
def test_a_bad_policy_folder_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    folder = policy(tmp_path / "policy")
    POLICIES[name](folder)
    with pytest.raises(BadInput) as caught:
        ExportedPolicy.load(folder)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 800
