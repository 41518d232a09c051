"""Settings hold the ranges beside their fields, whoever makes them, and say in words what was expected."""

import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.ranges import Name, Place, Range, Ranged, Seed, Share, Size, Text, Unfit, describe, fault, shown


@dataclass(frozen=True)
class Inner(Ranged):
    share: Share = 0.5


@dataclass(frozen=True)
class Settings(Ranged):
    count: Annotated[int, Range(least=1, most=1000)] = 1
    rate: Annotated[float, Range(above=0, below=1)] = 0.1
    pair: tuple[Share, Share] = (0.0, 1.0)
    each: Annotated[tuple[Seed, ...], Size(1, 3)] = (0,)
    weights: dict[Name, Share] = field(default_factory=dict)
    limit: Annotated[int, Range(least=0, most=9)] | None = None
    mode: Literal["a", "b"] = "a"
    place: Place = Path("x")
    on: bool = True
    inner: Inner = field(default_factory=Inner)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_order("pair")


@pytest.mark.parametrize(
    "value", [{"count": np.int64(3)}, {"rate": np.float32(0.5)}, {"rate": Fraction(1, 3)}, {"pair": (0, 1)}]
)
def test_numbers_of_other_types_are_numbers(value: dict[str, Any]):
    Settings(**value)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ({"count": 0}, "Settings.count: expected a whole number from 1 to 1,000, came 0"),
        ({"count": 1.0}, "Settings.count: expected a whole number from 1 to 1,000, came 1.0"),
        ({"count": True}, "Settings.count: expected a whole number from 1 to 1,000, came True"),
        ({"rate": 1.0}, "Settings.rate: expected a number above 0, below 1, came 1.0"),
        ({"rate": math.nan}, "Settings.rate: expected a number above 0, below 1, came nan"),
        ({"pair": (0.5, 2.0)}, "Settings.pair[1]: expected a number from 0 to 1, came 2.0"),
        ({"pair": (0.5,)}, "Settings.pair: expected a list of 2 values"),
        ({"pair": (1.0, 0.0)}, "Settings.pair: expected the smaller number first, came (1.0, 0.0)"),
        ({"each": ()}, "Settings.each: expected a list of whole numbers"),
        ({"each": (1, -1)}, "Settings.each[1]: expected a whole number from 0 to 2,147,483,647, came -1"),
        ({"weights": {"a": -1}}, "Settings.weights.a: expected a number from 0 to 1, came -1"),
        ({"weights": {"a\nb": 1}}, "Settings.weights: expected text of one line"),
        ({"limit": 10}, "Settings.limit: expected a whole number from 0 to 9 or nothing, came 10"),
        ({"mode": "c"}, "Settings.mode: expected one of a, b, came 'c'"),
        ({"place": ""}, "Settings.place: expected a path of one line"),
        ({"on": 1}, "Settings.on: expected true or false, came 1"),
        ({"inner": {}}, "Settings.inner: expected keys and values"),
    ],
)
def test_a_value_outside_is_refused_when_settings_are_made_and_when_they_are_changed(value: dict[str, Any], said: str):
    for make in (lambda: Settings(**value), lambda: replace(Settings(), **value)):
        with pytest.raises(Unfit) as caught:
            make()
        assert isinstance(caught.value, BadInput) and isinstance(caught.value, ValueError)
        assert str(caught.value).startswith(said)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, np.float64("nan"), np.float32("inf")])
def test_no_range_holds_what_is_not_finite_and_whole_numbers_of_any_length_are_compared(bad: float):
    assert not Range().holds(bad)
    assert Range().holds(10**5000) and not Range(most=1e300).holds(10**5000)


def test_a_text_is_one_line_without_control_characters():
    assert Text().holds("a b") and Text().holds("ñ/~x") and Text(empty=True).holds("")
    for bad in ("", "  ", "a\nb", "\x1b[2J", "a\x00", "a\u2028b", "\ud800", "x" * 1001):
        assert not Text().holds(bad)


def test_long_values_are_cut_in_messages_and_very_large_numbers_named():
    assert len(shown("x" * 10_000)) < 100
    assert shown(10**5000) == "a very large number"


def test_unannotated_parts_are_described_by_their_type():
    assert describe(tuple[int, ...]) == "a list of whole numbers"
    assert fault(tuple[int, ...], ["a"], "x") == ("x[0]", "a whole number", "a")
