"""A law's text is cut between its parts, never within a number."""

import re

import pytest

from bumblebee.diagnosis.candidates.short_term import short_term
from bumblebee.sim.effects import read_term

CURVE = (
    "curve(v, -0.97191, -0.065317, -0.54114, 0.030403, -0.35915, 0.055999, -0.22058, 0.11288, -0.062624, -0.11124, "
    "-0.0029912, -0.18973, 0.0039394, 0.2758)"
)
TEXTS = {
    "curve": CURVE,
    "sum": "0.125*sin(12.5*q) - 1.5e-05*v['left-hip']*abs(v['left-hip']) + relu(q - 0.12345)*exp(-3.25*abs(v - 1.75))",
    "nested": "friction(sin(3.25*q + bound(u - q, 0.125) + rested(0.3, 0.0215)))",
}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize("most", range(3, 120, 4))
def test_every_number_and_name_of_what_is_left_is_one_of_the_text(text: str, most: int) -> None:
    short, part = short_term(text, most), re.compile(r"\d[\w.]*(?:e-\d+)?|[a-z_-]{2,}")
    assert len(short) <= most or short == text
    assert set(part.findall(short)) <= set(part.findall(text))
    assert short == text or "..." in short
    assert short.count("(") == short.count(")") and short.count("[") == short.count("]")


def test_a_short_term_stays_and_a_long_one_says_that_it_goes_on() -> None:
    assert short_term("sin(3*q)", 60) == "sin(3*q)"
    assert short_term(CURVE, 60) == "curve(v, -0.97191, -0.065317, -0.54114, 0.030403, ...)"
    read_term(CURVE)
