"""The first sentences say what is gone, what is left in units of the task, what to trust; significance comes after."""

from types import SimpleNamespace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.report.effect_entries import at_bounds
from bumblebee.diagnosis.report.headline import effect_groups, headline, sized
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.report.removed_error import Ends, effectors, removed
from bumblebee.diagnosis.report.terminal import summary
from bumblebee.diagnosis.report.what_matters import bound_warnings, left_over, quantities, structure, trust
from bumblebee.diagnosis.thresholds.report import Matters, ReportThresholds
from bumblebee.sim.effects import CATALOGUE
from tests.measured.simulated import ARM_JOINTS, arm_model

RULE = Matters()


def effect(name: str, where: str, ends: list, explains: float, declared: float | None = 1.0) -> dict:
    size = {"value": 0.5 * sum(ends), "ci95": ends, "nominal": declared, "unit": ""}
    return {"effect": name, "where": [where], "parameters": {"factor": size}, "equivalent": [], "explains": explains,
            "evidence": {"p": 0.0, "test": ""}, "native": True}  # fmt: skip


def block(*values: float) -> dict:
    joints = {name: {"value": v, "ci95": None} for name, v in zip("abc", values, strict=False)}
    whole = float(np.sqrt(np.mean(np.square(values))))
    return {"0.2": {"joint_pos_rmse": {"value": whole, "ci95": None, "unit": "rad", "per_joint": joints}}}


def document() -> dict:
    """Three joints; most is gone, most of what is left is in b, and the tests see structure in a and b."""
    made = {
        "effects": [
            effect("kp", "a", [0.009, 0.011], 0.8), effect("kd", "a", [0.0, 0.2], 0.3),
            effect("armature", "b", [0.9, 1.1], 0.0, 0.2), effect("kp", "c", [0.01, 0.23], 0.0),
        ],
        "error": {
            "before": block(0.1, 0.1, 0.1), "after": block(0.01, 0.04, 0.0021), "floor": block(0.002, 0.002, 0.002),
        },
        "unexplained": {"significant": True, "p": 0.0, "where": ["a", "b"], "depends_on": ["time"], "description": "d"},
        "structure": {
            name: {"torque_rms": 0.3, "typical_torque": 3.0, "depends_on": ["time", "speed", "load"], "p": 0.0,
                   "explains": share, "law_shares": [], "law_quantities": []}
            for name, share in (("a", 0.01), ("b", 0.4))
        },
        "holdout": ["x", "y"],
    }  # fmt: skip
    share = {"what": "joints", "unit": "rad", "before": 0.1, "after": 0.0239, "floor": 0.002}
    made["summary"] = {
        "horizon": "0.2",
        "rollouts": 2,
        "removed": {"0.2": [share | {"share": 0.777, "ci95": [0.7, 0.81]}]},
        "left": left_over(made["error"], "0.2", {}),
        "ends": [{"what": "end", "where": "hand", "unit": "m", "before": 0.05, "value": 0.0123, "ci95": None}],
        "structure": structure(made, RULE),
        "trust": trust(made["effects"], RULE),
    }
    return made


def test_the_first_sentence_is_the_share_that_is_gone_in_degrees_with_its_interval() -> None:
    first, left, structured, trusted = headline(document(), ReportThresholds())
    assert first.startswith("After 0.2 s on 2 held-out rollouts, 78 % [70, 81] of the removable error")
    assert "5.7° to 1.4° RMS, noise 0.11°" in first
    assert left == "What is left after 0.2 s: b 2.3° (94 %), hand 12.3 mm off (declared 50 mm)."
    assert structured.startswith(
        "Part of it has structure: 40 % of the remaining chi-square, a missing torque at b (0.3 N m RMS"
    )
    assert structured.endswith("Significant, but below 5 % of the remaining chi-square: a.")
    assert "its gain comes from kp on a, kd on a; read as sizes by themselves kp on a; take the other 3 only" in trusted
    assert "(2 have intervals wider than 3-fold" in trusted


def test_page_and_terminal_begin_with_it_and_end_with_the_tests() -> None:
    made = document()
    page, text = render_report(made, []), summary(made)
    for out, tested in ((page, "Unexplained residual"), (text, "unexplained:")):
        order = [out.index(word) for word in ("of the removable error", "What is left", "only together", tested)]
        assert order == sorted(order)
    titles = [title for title, _ in effect_groups(made, ReportThresholds())]
    assert [title.split(":")[0] for title in titles] == [
        "Carry the gain", "Needed beside the others, no gain of their own shown", "Not to be trusted alone"
    ]  # fmt: skip
    assert all(title in page for title in titles) and "3-fold" in titles[-1]


@pytest.mark.parametrize(
    ("ends", "declared", "explains", "group", "wide"),
    [
        ([0.9, 1.1], 0.2, 0.5, "carry", False),
        ([0.0, 0.2], 1.0, 0.5, "carry", True),
        ([0.9, 1.1], 0.2, 0.0, "beside", False),
        ([0.2, 1.1], 0.1, 0.0, "wide", True),
        ([0.9, 1.1], 1.0, 0.0, "wide", True),
        ([-1.1, -0.9], 0.0, 0.0, "beside", False),
        ([0.9, None], None, 0.0, "wide", True),
    ],
)
def test_an_effect_is_trusted_by_what_it_explains_and_how_wide_its_interval_is(
    ends: list, declared: float | None, explains: float, group: str, wide: bool
) -> None:
    made = effect("kp", "a", [0.0, 0.0], explains, declared)
    made["parameters"]["factor"]["ci95"] = ends
    (told,) = trust([made], RULE)
    assert (told["group"], told["wide"]) == (group, wide)


def test_an_effect_at_the_end_of_its_range_is_no_size_and_a_warning() -> None:
    made = document()
    made["effects"][0]["parameters"]["factor"]["at_bound"] = True
    made["summary"]["trust"] = trust(made["effects"], RULE)
    made["warnings"] = bound_warnings(made["effects"])
    assert (
        made["warnings"][0].startswith("at the end of the values that are tried") and "kp on a" in made["warnings"][0]
    )
    said = headline(made, ReportThresholds())[-1]
    assert "as a whole" not in said and "read as sizes by themselves none" in said
    assert "1 at the end of the values that are tried" in said


def test_the_bound_is_where_a_fit_may_go_no_further() -> None:
    candidate = Candidate("motor_strength", "j1", (1.0,), (-0.1,), (0,))
    low, high = CATALOGUE["motor_strength"].bounds(candidate.nominal, candidate.limits)
    assert [at_bounds(candidate, np.array([v])).tolist() for v in (low[0], 0.8, high[0], 1.0)] == [
        [True], [False], [True], [False],
    ]  # fmt: skip


def test_the_interval_of_a_lone_rollout_is_over_its_windows() -> None:
    rng = np.random.default_rng(0)
    before, after = (size * rng.standard_normal((60, 1, 3)) for size in (0.1, 0.099))
    ends = Ends(cuts(np.zeros(60, dtype=int), np.zeros((60, 3))), {"0.2": before}, {"0.2": after})
    (told,) = removed(ends, {"floor": block(0.02, 0.02, 0.02)}, RULE)["0.2"]
    assert told["ci95"][0] < 0 < told["ci95"][1]


def test_quantities_are_cut_to_what_explains_most_of_the_torque() -> None:
    entry = {"law_shares": [0.02, 0.3, 0.05], "law_quantities": [["time"], ["position", "load"], ["speed"]],
             "depends_on": ["time", "position", "load", "speed"]}  # fmt: skip
    assert quantities(entry, RULE) == ["position", "load"]
    assert quantities({"depends_on": ["time", "speed", "load"]}, RULE) == ["time", "speed"]


def test_effects_of_like_size_on_several_joints_are_one_line() -> None:
    made = document()
    made["effects"] = [effect("encoder_quantisation", name, [1e-3, 1e-3], 0.0, 0.0) for name in "abc"]
    made["summary"]["trust"] = trust(made["effects"], RULE)
    ((_, listed),) = effect_groups(made, ReportThresholds())
    assert [e["where"] for e in listed] == [["a", "b", "c"]] and len(made["effects"][0]["where"]) == 1


def test_a_model_that_is_worse_is_not_called_better() -> None:
    made = document()
    made["summary"]["removed"]["0.2"][0] |= {"after": 0.15, "share": -0.5, "ci95": [-0.9, -0.1]}
    first, *_, trusted = headline(made, ReportThresholds())
    assert "the error of the joints is larger: 5.7° to 8.6° RMS" in first
    assert trusted == (
        "Do not trust the corrected model: at no horizon is it surely better; "
        "it is worse than the declared one after 0.2 s."
    )


def entry(share: float | None, ends: list | None, after: float = 0.05, what: str = "joints") -> dict:
    """One kind of joint at one horizon; without a share the declared model is at the noise floor."""
    floor = 0.002 if share is not None else 0.1
    return {"what": what, "unit": "rad", "before": 0.1, "after": after, "floor": floor, "share": share, "ci95": ends}


GAINED, LOST, UNSURE = entry(0.5, [0.4, 0.6]), entry(-0.2, [-0.3, -0.1], 0.12), entry(0.1, [-0.5, 0.6])
AT_FLOOR, LEFT_FLOOR = entry(None, None), entry(None, None, 0.2)
SLIDES, LOST_SLIDES = GAINED | {"what": "slides"}, LOST | {"what": "slides"}
VERDICTS = {
    "better": ([[GAINED], [GAINED]], "Trust the corrected model as a whole (better after 0.2, 1.0 s); its gain"),
    "unsure": ([[GAINED], [UNSURE]], "only where it is better, after 0.2 s: not surely better after 1.0 s; its gain"),
    "a trifle": ([[entry(0.01, None, 0.099)]], "Do not trust the corrected model: at no horizon is it surely better"),
    "floor": ([[GAINED], [AT_FLOOR]], "better after 0.2 s; the declared model is at the noise floor after 1.0 s); its"),
    "worse": ([[GAINED], [LOST]], "only where it is better, after 0.2 s: it is worse than the declared one after 1.0"),
    "off it": ([[GAINED], [LEFT_FLOOR]], "only where it is better, after 0.2 s: it is worse than the declared"),
    "one run": ([[entry(0.5, None)], [entry(-0.5, None, 0.15)]], "is better, after 0.2 s: it is worse than the"),
    "slides": ([[GAINED, SLIDES], [GAINED, LOST_SLIDES]], "only where it is better, after 0.2 s, 1.0 s (joints): it is "
               "worse than the declared one after 1.0 s (slides); its gain"),
    "one kind": ([[UNSURE, SLIDES]], "only where it is better, after 0.2 s (slides): not surely better after 0.2"),
    "nothing": ([[AT_FLOOR], [AT_FLOOR]], "nothing to gain: the declared model is at the noise floor after 0.2, 1.0 s"),
    "no gain": ([[AT_FLOOR], [UNSURE]], "at no horizon is it surely better; the declared model is at the noise floor "
                "after 0.2 s."),
}  # fmt: skip


@pytest.mark.parametrize("name", VERDICTS)
def test_the_model_is_trusted_at_the_horizons_at_which_it_is_better(name: str) -> None:
    entries, words = VERDICTS[name]
    made = document()
    made["summary"]["removed"] = dict(zip(("0.2", "1.0"), entries, strict=False))
    assert words in headline(made, ReportThresholds())[-1]


def test_an_error_that_left_the_noise_floor_is_said_to_be_larger() -> None:
    made = document()
    made["summary"]["removed"]["0.2"] = [LEFT_FLOOR]
    first = headline(made, ReportThresholds())[0]
    assert "(5.7° RMS) is at the noise floor, the corrected model's is larger (11°)" in first


@pytest.mark.parametrize("entries", [[UNSURE], [LOST], [AT_FLOOR]])
def test_without_a_gain_nothing_is_said_to_come_from_an_effect(entries: list) -> None:
    made = document()
    made["summary"]["removed"]["0.2"] = entries
    titles = [title.split(":")[0] for title, _ in effect_groups(made, ReportThresholds())]
    assert titles == ["Found on the fitted windows, no gain on held-out data shown", "Not to be trusted alone"]
    for text in (summary(made), render_report(made, [])):
        assert "arry the gain" not in text and "gain comes from" not in text and "gain of their own" not in text
        assert "ound on the fitted windows, no gain on held-out data shown" in text
    assert ("only together" in headline(made, ReportThresholds())[-1]) is (entries == [AT_FLOOR])


def test_an_error_below_the_expected_noise_is_no_better_than_one_at_it() -> None:
    made = document()
    made["summary"]["removed"]["0.2"][0] |= {"after": 0.0019, "share": 1.001, "ci95": [0.99, 1.01]}
    first = headline(made, ReportThresholds())[0]
    assert (
        "100 % [99, 101]" in first and "at the noise floor: the error of a complete model scatters about 0.11°" in first
    )


def test_thresholds_decide_what_is_proclaimed() -> None:
    slack = ReportThresholds(matters=Matters(structure=0.005))
    assert all(entry["proclaimed"] for entry in structure(document(), slack.matters))


def cuts(rollouts: np.ndarray, measured: np.ndarray) -> SimpleNamespace:
    """Windows of the arm as the error block cuts them."""
    model = arm_model()
    plant = SimpleNamespace(model=model, joints=ARM_JOINTS, qpos=np.arange(3))
    part = SimpleNamespace(rollout=rollouts, measured=measured[:, None])
    layout = SimpleNamespace(slices={"joint_pos": slice(0, 3)})
    return SimpleNamespace(
        plant=plant, layout=layout, windows={"0.2": part}, rule=ReportThresholds().prediction_error
    )  # fmt: skip


def test_the_share_that_is_gone_counts_from_the_floor_and_its_interval_holds_it() -> None:
    rng, rollouts = np.random.default_rng(0), np.repeat(np.arange(8), 30)
    before, after = (size * rng.standard_normal((240, 1, 3)) for size in (0.1, 0.04))
    ends = Ends(cuts(rollouts, np.zeros((240, 3))), {"0.2": before}, {"0.2": after})
    error = {"floor": block(0.02, 0.02, 0.02)}
    (entry,) = removed(ends, error, RULE)["0.2"]
    assert entry["share"] == pytest.approx(0.06 / 0.08, abs=0.03)
    assert entry["ci95"][0] < 0.75 < entry["ci95"][1] and entry["ci95"][1] - entry["ci95"][0] < 0.15
    (nothing,) = removed(Ends(ends.cuts, {"0.2": after / 2}, {"0.2": after / 2}), error, RULE)["0.2"]
    assert nothing["share"] is None


def test_windows_that_diverged_are_left_out_on_both_sides() -> None:
    before = np.full((20, 1, 3), 0.1)
    after = np.full((20, 1, 3), 0.05)
    after[3] = np.nan
    before[3] = 50.0
    ends = Ends(cuts(np.arange(20) % 2, np.zeros((20, 3))), {"0.2": before}, {"0.2": after})
    (entry,) = removed(ends, {"floor": block(0.0, 0.0, 0.0)}, RULE)["0.2"]
    assert entry["share"] == pytest.approx(0.5)


def test_the_end_of_the_chain_moves_by_the_lever_of_each_joint() -> None:
    """The wrist's body hangs 0.6 m below the shoulder, its centre of mass 0.05 m below the wrist."""
    off = np.zeros((4, 1, 3))
    off[:, 0, 0] = 0.01
    ends = Ends(cuts(np.array([0, 0, 1, 1]), np.zeros((4, 3))), {"0.2": 2 * off}, {"0.2": off})
    (entry,) = effectors(ends, "0.2")
    assert entry["value"] == pytest.approx(0.65 * 0.01, rel=1e-3) and entry["before"] == pytest.approx(0.013, rel=1e-3)


def test_sizes_are_degrees_and_millimetres() -> None:
    assert (sized(np.pi / 180, "rad"), sized(0.0123, "m"), sized(None, "m")) == ("1°", "12.3 mm", "-")
