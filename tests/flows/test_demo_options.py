"""A workspace that is given as it is takes no option that would change it."""

import pytest

from bumblebee.errors import BadInput
from flows.demo import folder_of, parser


@pytest.mark.parametrize("more", (["--profile", "paper"], ["--seed", "4"], ["--name", "a"], ["--motions", "m"]))
def test_a_workspace_as_it_is_takes_no_option_that_would_change_it(more: list[str]) -> None:
    with pytest.raises(BadInput, match=f"--workspace: expected a workspace as it is, came {more[0]} beside it"):
        folder_of(parser().parse_args(["--workspace", "runs/mine", *more]))


def test_a_workspace_alone_is_taken() -> None:
    assert str(folder_of(parser().parse_args(["--workspace", "runs/mine"]))) == "runs/mine"
