"""The page for the person at the gate: what binds the answer, units, and a telephone's width."""

import re
from base64 import b64decode
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.measured import overview_plots as plots
from bumblebee.measured.rollout import Rollout
from tasks.approvals.gate import seen_of
from tasks.pages.overview import write_overview

MODEL = """<mujoco><worldbody><body><joint name="rail" type="slide"/><geom size="0.1" mass="1"/>
<body><joint name="pole" type="hinge"/><geom size="0.1" mass="1"/></body></body></worldbody></mujoco>"""
COUNTS = {"round": 1, "accepted": 1, "quarantined": 0, "seconds": 1.0, "joints": ["rail", "pole"]}
SUMMARY = COUNTS | {"by_rule": {}, "by_cluster": {}, "by_motion": {}}


def pictures(text: str) -> list[str]:
    """SVG that lies in a page's addresses."""
    return [b64decode(uri).decode() for uri in re.findall(r"data:image/svg\+xml;base64,([^\"]+)", text)]


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """Written in a folder as the stage ingest has it."""
    (tmp_path / "model.xml").write_text(MODEL)
    (tmp_path / "summary.json").write_text("{}")
    time = np.linspace(0.0, 1.0, 50)
    pos = np.stack([0.2 * time, time], axis=1)
    target = pos + np.array([0.0123, 0.0456])
    rollout = Rollout("a", ("rail", "pole"), 50.0, time, pos, np.ones_like(pos), joint_target=target)
    write_overview(tmp_path / "overview.html", SUMMARY, pd.DataFrame(columns=["fatal", "message"]), [rollout])
    return tmp_path / "overview.html"


def test_the_page_names_the_hash_that_an_answer_needs_and_no_folder_of_this_machine(page: Path) -> None:
    seen = seen_of(page.with_name("summary.json"))["sha256"]
    text = page.read_text()
    for verb in ("approve", "reject --note WHY", "more --note WHAT"):
        verb, *note = verb.split(maxsplit=1)
        assert f">{' '.join(['bumblebee gate', verb, '1 --seen', seen[:12], *note])}</td>" in text
    assert str(page.parent) not in text


def test_slides_are_in_mm_and_hinges_in_mrad(page: Path) -> None:
    text = page.read_text()
    hinges, slides, *_ = pictures(text)
    assert "45.6 mrad<" in hinges and "12.3 mm<" in slides and "12.3 mrad" not in hinges + slides
    assert text.index("Hinges") < text.index("Slides")


def test_the_page_fits_a_telephone(page: Path) -> None:
    text = page.read_text()
    assert 'name="viewport" content="width=device-width' in text and "img{width:100%" in text
    assert not any(re.search(r"<svg[^>]* width=", picture) for picture in pictures(text))


def test_a_round_without_one_good_file_offers_no_approval(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text("{}")
    nothing = SUMMARY | {"accepted": 0, "quarantined": 2}
    write_overview(tmp_path / "overview.html", nothing, pd.DataFrame(columns=["fatal", "message"]), [])
    assert "gate approve" not in (tmp_path / "overview.html").read_text()


@pytest.mark.parametrize(("value", "text"), [(1234.5, "1234"), (12.34, "12.3"), (1.234, "1.23"), (0.1234, "0.123")])
def test_numbers_have_three_digits_that_count(value: float, text: str) -> None:
    assert plots.rounded(value) == text
