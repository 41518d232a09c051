"""A window gets the captions that describe it, and no others."""

import pytest

from bumblebee.motion.describe.windows import captions_in


def _line(since: float, until: float) -> str:
    return f"a person walks#a/DET person/NOUN walk/VERB#{since}#{until}"


@pytest.mark.parametrize(
    ("caption", "window", "counts"),
    [
        ((0, 0), (40, 48), True),  # of the whole motion
        ((3, 4), (0, 8), True),  # short, inside
        ((0, 40), (16, 24), True),  # long, around
        ((4, 12), (0, 8), True),  # exactly half of either
        ((4.1, 12), (0, 8), False),
        ((7.4, 8.4), (0, 8), True),  # 0.6 s of the caption's 1 s
        ((7.6, 8.6), (0, 8), False),
        ((8, 16), (0, 8), False),  # they only touch
        ((9, 16), (0, 8), False),
        ((3, 3), (0, 8), True),  # a moment inside
        ((9, 9), (0, 8), False),
        ((5, 2), (0, 8), False),  # ends before it starts: describes nothing
    ],
)
def test_a_caption_counts_if_it_shares_half_of_the_shorter_with_the_window(caption, window, counts):
    assert captions_in([_line(*caption)], *window) == ((_line(*caption),) if counts else ())


def test_captions_come_as_they_are_in_their_order_and_the_share_can_be_set():
    lines = [_line(0, 4), _line(6, 20), _line(0, 0)]
    assert captions_in(lines, 0, 8) == (lines[0], lines[2])
    assert captions_in(lines, 0, 8, least_overlap=0.2) == tuple(lines)
