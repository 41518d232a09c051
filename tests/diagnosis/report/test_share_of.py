"""A size beside another is a share up to all of it, and a multiple beyond."""

from bumblebee.diagnosis.report import share_of


def test_a_share_is_at_most_all() -> None:
    assert share_of(0.3, 2.0) == "15 %" and share_of(2.0, 2.0, "it") == "100 % of it"
    assert share_of(3.62, 2.0, "its drive's") == "1.8 times its drive's"
    assert share_of(1.0, 0.0) == "-"
