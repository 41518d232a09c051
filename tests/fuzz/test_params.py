"""Whatever stands in params.yaml, the check ends well or in one line."""

import copy
import math
import os
import random
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_yaml
from tasks import sections
from tasks.settings import params
from tests.fuzz.budget import rounds
from tests.tasks.settings.small import HOME, shipped

FILE = Path("params.yaml")
TEXT = (HOME / "params.yaml").read_text()
NUMBERS = (0, -1, 1, 2**31, 2**63, 10**400, 0.0, -0.5, 1e-300, 1e300, math.nan, math.inf, -math.inf)
WORDS = (
    "",
    " ",
    "1e-4",
    "1e999",
    ".nan",
    "embedded",
    "a\nb",
    "\x00",
    "\u2028",
    "~nobody/x",
    "/",
    "{}",
    "{round}",
    "x" * 5000,
)
OTHERS = (None, True, [], {}, [[]], [None], {"a": {}}, {1: 2}, {None: 1}, b"\xff", (1, 2))
SIGNS = "\t\n {}[]:,-#&*!|>'\"%@`0e.~<\x00\x85\ud800é"


def refused(text: str) -> str | None:
    """The line that refuses the text; None where it passes. Any other exception is a defect."""
    try:
        content = parse_yaml(FILE, text)
        if not isinstance(content, dict):
            return None
        sections.check_content(content, FILE)
    except BadInput as error:
        assert len(str(error).splitlines()) == 1 and len(str(error)) < 5000
        str(error).encode(errors="backslashreplace")
        return str(error)
    return None


def judged(content: dict[Any, Any]) -> None:
    """Judge settings that are no text."""
    try:
        sections.check_content(content, FILE)
    except BadInput as error:
        assert len(str(error).splitlines()) == 1 and len(str(error)) < 5000


def mutated(content: Any, draw: random.Random) -> Any:
    """Settings with one to four keys or values changed, removed, added or swapped."""
    content = copy.deepcopy(content)
    for _ in range(draw.randint(1, 4)):
        places = list(_places(content))
        holder, key = draw.choice(places)
        change = draw.randrange(5)
        if change == 0 and isinstance(holder, dict):
            holder[draw.choice([f"{key}s", str(key).upper(), 3, None, "", "seed", "env", "ppo"])] = holder.pop(key)
        elif change == 1 and isinstance(holder, dict):
            del holder[key]
        elif change == 2:
            other, its = draw.choice(places)
            holder[key] = copy.deepcopy(other[its])
        else:
            holder[key] = copy.deepcopy(draw.choice([*NUMBERS, *WORDS, *OTHERS]))
        if not content:
            break
    return content


def _places(content: Any) -> Any:
    for key in list(content) if isinstance(content, dict) else range(len(content)):
        yield content, key
        if isinstance(content[key], dict | list) and content[key]:
            yield from _places(content[key])


def scribbled(text: str, draw: random.Random) -> str:
    """The text with some of its signs changed, lines doubled or cut."""
    for _ in range(draw.randint(1, 6)):
        at, to = sorted(draw.randrange(len(text) + 1) for _ in range(2))
        kind = draw.randrange(4)
        if kind == 0:
            text = text[:at] + draw.choice(SIGNS) + text[at:]
        elif kind == 1:
            text = text[:at] + text[min(at + draw.randint(1, 8), len(text)) :]
        elif kind == 2:
            text = text[:at] + text[at : min(to, at + 200)] + text[at:]
        else:
            text = text[:at] + draw.choice(WORDS[:-1]) + text[at + 1 :]
    return text


def full() -> dict[str, Any]:
    """The shipped settings with every section spelled out, so that every field can be changed."""
    from tests.tasks.settings.small import classes

    def spelled(value: Any) -> Any:
        if type(value) in known:
            return {name: spelled(getattr(value, name)) for name in value.__dataclass_fields__}
        if isinstance(value, tuple | list):
            return [spelled(inner) for inner in value]
        return str(value) if isinstance(value, Path) else value

    known = set(classes())
    found = sections.check_content(shipped(), FILE)
    return spelled(found.pop("")) | {name: spelled(value) for name, value in found.items()}


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(section=st.sampled_from(list(params.SECTIONS)), value=PLAIN)
@example(section="seal", value={"seed": 10**5000})
@example(section="base", value={10**5000: 1})
@example(section="filter", value={"joint_speed": 10**400})
def test_any_plain_data_in_a_section_ends_well_or_in_one_line(section: str, value: Any):
    judged(shipped() | {section: value})


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(text=st.text(max_size=200) | st.binary(max_size=100).map(lambda data: data.decode("latin-1")))
@example(text="seal: {seed: 0x" + "f" * 9000 + "}")
@example(text="? [a, b]\n: 1\n")
@example(text="<<: *none")
def test_any_text_ends_well_or_in_one_line(text: str):
    refused(text)


def test_every_section_spelled_out_passes():
    judged(full())
    assert refused(yaml.safe_dump(full())) is None


def test_changed_settings_and_scribbled_text_end_well_or_in_one_line():
    whole, passed, count = full(), 0, 0
    first = int(os.environ.get("BUMBLEBEE_FUZZ_SEED", "0"))
    for number in rounds(0.8):
        draw = random.Random(first + number)
        try:
            judged(mutated(whole, draw))
            passed += refused(scribbled(TEXT, draw)) is None
        except Exception as error:
            pytest.fail(f"BUMBLEBEE_FUZZ_SEED={first + number} reproduces {type(error).__name__}: {error}")
        count = number + 1
    print(f"{count} changed files, {passed} scribbled ones passed")
