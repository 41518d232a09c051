"""A slide's numbers have a slide's units wherever a person reads them, and are never added to a hinge's in silence."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.config import DiagnosisConfig, SearchConfig
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.diagnose import Diagnosis, diagnose
from bumblebee.diagnosis.gap.gap import gap
from bumblebee.diagnosis.gap.page import gap_page
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.report.terminal import gap_summary, summary
from bumblebee.effects.units import both_units, joint_unit
from bumblebee.sim.effects import CATALOGUE
from tests.diagnosis import cart

SHORT = SearchConfig(most=1, trials=1, simulated=3, patience=1, shortlist=0, far=1e9, many=1e9)
TINY = DiagnosisConfig(
    max_windows=8, max_holdout_windows=6, report_windows=4, grow=False, beyond=False, search=SHORT
)  # the units are asked about, not the diagnosis
TURNING = ("rad", "N m", "kg m^2")


@pytest.fixture(scope="module")
def session() -> Session:
    rollouts = cart.record(count=2, friction=(6.0, 0.0), reported=True)
    return make_session(mujoco.MjSpec.from_string(cart.xml()), rollouts, "cart", "memory")


@pytest.fixture(scope="module")
def found(session: Session) -> Diagnosis:
    return diagnose(session, TINY)


def test_every_unit_of_the_catalogue_has_one_for_slides():
    units = {p.unit for kind in CATALOGUE.values() if kind.on == "joint" for p in kind.parameters}
    for unit in units:
        assert not any(part in joint_unit(unit, True) for part in ("N m", "kg m", "mrad")), unit
        assert joint_unit(unit, False) == unit
    assert joint_unit("N m s/rad", True) == "N s/m"
    assert both_units("N m") == "N m (N on a slide)" and both_units("s") == "s"


def test_an_effect_on_a_slide_has_the_slides_unit(found: Diagnosis):
    (effect,) = [e for e in found.document["effects"] if e["where"] == ["cart"]]
    assert effect["effect"] == "coulomb_friction"
    assert effect["parameters"]["frictionloss"]["unit"] == "N"
    small = {(e["effect"], e["where"][0]): e["unit"] for e in found.document["smallest_detectable"] if e["where"]}
    assert small["armature", "cart"] == "kg" and small["armature", "pole"] == "kg m^2"
    assert small["viscous_friction", "cart"] == "N s/m"


def test_errors_of_hinges_and_slides_stand_apart(found: Diagnosis):
    entry = found.document["error"]["before"]["0.2"]["joint_pos_rmse"]
    each = {joint: value["value"] for joint, value in entry["per_joint"].items()}
    assert (
        entry["by_kind"]["slide"]["value"] == pytest.approx(each["cart"]) and entry["by_kind"]["slide"]["unit"] == "m"
    )
    assert entry["by_kind"]["hinge"]["value"] == pytest.approx(each["pole"])
    assert entry["value"] == pytest.approx(np.sqrt((each["cart"] ** 2 + each["pole"] ** 2) / 2))
    assert "1 m as 1 rad" in entry["unit"]
    assert any("1 mm counts as 1 mrad" in note for note in found.document["notes"])


def said_of(text: str, joint: str, other: str) -> list[str]:
    return [line for line in text.splitlines() if joint in line and other not in line and "note" not in line]


def test_no_line_about_the_slide_names_a_turning_unit(session: Session, found: Diagnosis):
    report = gap(session)
    lines = said_of(summary(found.document), "cart", "pole")
    lines += said_of(gap_summary(report.document, report.examples), "cart", "pole")
    assert len(lines) > 3
    for line in lines:
        assert not any(unit in line for unit in TURNING), line
    assert "slides [mm]" in summary(found.document)


@pytest.mark.parametrize("page", ["report", "gap"])
def test_the_pages_label_the_slide_by_its_own_units(session: Session, found: Diagnosis, page: str):
    html = render_report(found.document, []) if page == "report" else gap_page(gap(session))
    assert "cart [mm]" in html and "pole [mrad]" in html
    rows = [row for row in html.replace("<tr>", "\n<tr>").splitlines() if ">cart" in row or "cart [" in row]
    assert rows
    for row in rows:
        assert not any(f"[{unit}]" in row or f"{unit}<" in row for unit in TURNING), row
