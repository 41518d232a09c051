"""Sealing: by seed and attempt, from the whole catalogue and outside it, of sizes that matter, at distinct places."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.report.truth import match
from bumblebee.robot.facts import joint_names
from bumblebee.sim.effects import CATALOGUE as EFFECTS
from bumblebee.stand_in.sealed import declared_g1, to_laws
from bumblebee.stand_in.undeclared.faults import largest, peaks
from bumblebee.stand_in.undeclared.kinds import CATALOGUE, KINDS, Place
from tasks import seal
from tasks.on_robot.seal_trial import Trial
from tasks.running import paths
from tasks.seal import BODIES, OF_G1, SealConfig, draw, region


def test_seed_and_attempt_decide_and_others_draw_otherwise() -> None:
    draws = [draw(SealConfig(seed=seed), attempt) for seed in range(10) for attempt in range(2)]
    assert draws == [draw(SealConfig(seed=seed), attempt) for seed in range(10) for attempt in range(2)]
    assert len({str(effects) for effects in draws}) == 20


def test_effects_are_of_distinct_kinds_at_distinct_places_and_the_robot_takes_them() -> None:
    for seed in range(30):
        effects = draw(SealConfig(seed=seed, n_effects=6))
        spots = {(KINDS[e["effect"]].on, *e["where"]) for e in effects}
        assert len({e["effect"] for e in effects}) == len(spots) == len(to_laws(effects)) == 6


def test_every_kind_that_a_g1_can_have_is_drawn_and_every_joint_and_body_of_weight() -> None:
    drawn = [e for seed in range(250) for e in draw(SealConfig(seed=seed, outside=1.0, n_effects=8))]
    assert {e["effect"] for e in drawn} == set(OF_G1)
    assert set(joint_names()) | set(BODIES) <= {name for e in drawn for name in e["where"]}


@pytest.mark.parametrize(("chance", "least", "most"), [(0.0, 0, 0), (0.34, 40, 95), (1.0, 200, 200)])
def test_at_most_one_effect_is_outside_the_catalogue_and_as_often_as_told(chance: float, least: int, most: int) -> None:
    counts = Counter(
        sum(KINDS[e["effect"]].outside for e in draw(SealConfig(seed=seed, outside=chance))) for seed in range(200)
    )
    assert set(counts) <= {0, 1} and least <= counts[1] <= most


def test_a_null_robot_has_none() -> None:
    assert draw(SealConfig(n_effects=0, outside=1.0)) == []


@pytest.mark.parametrize("kind", OF_G1)
def test_a_size_is_a_share_of_the_largest_fault_and_severity_takes_it_there(kind: str) -> None:
    for seed in range(5):
        for severity in (1.0, 50.0):
            wanted = SealConfig(seed=seed, kinds=(kind,), n_effects=1, outside=1.0, severity=severity)
            (effect,) = draw(wanted)
            drawn = {name: effect["draw"][name] for name in ("sign", "axis", "number", "other")}
            where = effect["where"][0] if effect["where"] else ""
            place = Place(declared_g1(), where, drawn, *peaks().get(where, (0, 0, 0)))
            least = 0.399 if severity == 1 else 0.999
            assert least <= effect["size"] / largest(KINDS[kind], place) <= 1.0


def test_a_draw_that_is_drawn_again_is_worse() -> None:
    config = SealConfig(kinds=("link_mass",), bodies=("torso_link",), n_effects=1, severity=0.2)
    means = [sum(draw(replace(config, seed=seed), attempt)[0]["size"] for seed in range(40)) for attempt in (0, 8)]
    assert means[1] > 2 * means[0]


def test_half_of_the_joints_are_in_the_legs_the_others_in_waist_and_arms() -> None:
    config = SealConfig(kinds=("encoder_offset",), n_effects=1)
    counts = Counter(region(draw(replace(config, seed=seed))[0]["where"][0]) for seed in range(200))
    assert 80 <= counts["leg"] <= 120 and 30 <= counts["waist"] <= 70 and 30 <= counts["arm"] <= 70


@pytest.fixture
def trials(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Trial]:
    """A workspace in which the policy's trials end as this list says, one draw after the other."""
    monkeypatch.chdir(tmp_path)
    Path("params.yaml").write_text("seal: {seed: 4, draws: 3}\nrollouts: {}\n")
    monkeypatch.setattr(seal, "log_run", lambda *_, **__: None)
    outcomes: list[Trial] = []
    monkeypatch.setattr(seal, "load_policy", lambda folder: print(f"policy of {folder}"))
    monkeypatch.setattr(seal, "export_policy", lambda folder, policy: None)
    monkeypatch.setattr(seal, "trial_clips", lambda config: ["clip"])
    monkeypatch.setattr(seal, "followed", lambda policy, clips, *_: clips)
    monkeypatch.setattr(seal, "try_robot", lambda *_: outcomes.pop(0))
    return outcomes


def test_a_robot_is_drawn_again_until_the_policy_loses_a_third_and_yet_can_be_measured(
    trials: list[Trial], capsys: pytest.CaptureFixture[str]
) -> None:
    trials += [Trial(0.2, 5.0), Trial(1.0, 0.4), Trial(0.5, 3.0)]
    seal.main()
    sealed = json.loads(paths.SEALED_ROBOT.read_text())
    assert sealed["attempt"] == 2 and sealed["effects"] == draw(SealConfig(seed=4), 2)
    assert sealed["trial"]["lost"] == 0.5
    said = capsys.readouterr().out
    assert said.count("not taken") == 2
    assert not any(effect["effect"] in said for effect in sealed["effects"])  # the seal stays closed


def test_the_policy_that_was_brought_along_is_the_one_that_is_tried(
    trials: list[Trial], capsys: pytest.CaptureFixture[str]
) -> None:
    trials += [Trial(0.5, 3.0)] * 2
    seal.main()
    assert f"policy of {pretrained.FOLDER}\n" in capsys.readouterr().out
    Path("params.yaml").write_text(Path("params.yaml").read_text() + "base: {init: own}\n")
    seal.main()
    assert "policy of data/policy\n" in capsys.readouterr().out


def test_where_no_draw_will_do_the_one_that_loses_most_and_stands_is_sealed_and_a_line_says_so(
    trials: list[Trial], capsys: pytest.CaptureFixture[str]
) -> None:
    trials += [Trial(0.1, 5.0), Trial(0.25, 5.0), Trial(1.0, 0.3)]
    seal.main()
    assert json.loads(paths.SEALED_ROBOT.read_text())["attempt"] == 1
    assert "none of 3 draws loses 33%: the one that loses 25% is sealed" in capsys.readouterr().out


def test_motions_that_the_policy_does_not_follow_at_all_are_no_reason_to_stop(
    trials: list[Trial], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(seal, "followed", lambda *_: [])
    seal.main()
    assert json.loads(paths.SEALED_ROBOT.read_text())["attempt"] == 0
    assert "no loss to measure" in capsys.readouterr().out


@pytest.mark.parametrize("line", ["seal: {n_effects: 0}\nrollouts: {}", "seal: {}\nrollouts: {source: mine}"])
def test_nothing_is_tried_for_a_null_robot_or_beside_a_real_one(trials: list[Trial], line: str) -> None:
    Path("params.yaml").write_text(line + "\n")
    seal.main()
    assert json.loads(paths.SEALED_ROBOT.read_text())["attempt"] == 0


def test_the_largest_faults_are_stated_for_every_kind_and_the_usual_peaks_for_every_joint() -> None:
    assert [name for name in OF_G1 if KINDS[name].fault is None] == [] and set(peaks()) == set(joint_names())


def test_parameters_have_the_names_of_the_catalogue() -> None:
    for kind in CATALOGUE:
        (effect,) = draw(SealConfig(kinds=(kind.name,), n_effects=1))
        declared = {parameter.name for parameter in EFFECTS[kind.name].parameters}
        assert set(effect["parameters"]) <= declared, kind.name


def test_an_effect_outside_the_catalogue_pairs_as_a_law_without_a_name_and_one_inside_by_name() -> None:
    inside, outside = (draw(SealConfig(kinds=(k,), n_effects=1, outside=1.0, joints=("left_knee_joint",)))[0]
                       for k in ("coulomb_friction", "drag"))  # fmt: skip
    found = [
        {"effect": name, "where": ["left_knee_joint"], "parameters": {}} for name in ("coulomb_friction", "discovered")
    ]
    rows = match([inside, outside], found)
    assert [(row.sealed, row.found, row.through) for row in rows] == [
        (inside, found[0], "exact"), (outside, found[1], "form"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [
        {"kinds": ("gremlin",)},
        {"kinds": ("loose_mount",)},  # a G1 has no mount
        {"joints": ("left_tail",)},
        {"joints": ()},
        {"bodies": ("tail",)},
        {"bodies": ("left_ankle_pitch_link",)},  # too light to be felt
        {"n_effects": 99},
    ],
)
def test_what_does_not_exist_is_named(change: dict) -> None:
    with pytest.raises(BadInput, match=f"SealConfig.{next(iter(change))}"):
        draw(replace(SealConfig(), **change))


@pytest.mark.parametrize(
    ("kinds", "most"),
    [
        (("coulomb_friction", "viscous_friction", "link_mass"), 2),  # one joint, two bodies
        (("ground_friction", "ground_slope", "imu_offset"), 2),  # one ground, one IMU
        (("drag", "ripple"), 1),  # outside: never more than one
        (("coulomb_friction", "drag"), 1),
    ],
)
def test_as_many_effects_as_places_allow_are_drawn_and_one_more_is_refused(kinds: tuple[str, ...], most: int) -> None:
    config = SealConfig(kinds=kinds, joints=("left_knee_joint",), bodies=("pelvis", "torso_link"), n_effects=most)
    assert all(len(draw(replace(config, seed=seed))) == most for seed in range(20))
    with pytest.raises(BadInput, match=rf"SealConfig.n_effects: expected at most {most}"):
        replace(config, n_effects=most + 1)
