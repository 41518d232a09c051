"""Scores, intervals and the table: they say of made documents what a person would."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.undeclared.__main__ import chosen, main, read_lines
from benchmarks.undeclared.judge import achieved, score
from benchmarks.undeclared.lottery import Suite
from benchmarks.undeclared.rivals.pace import evolve
from benchmarks.undeclared.stats import bootstrap, wilson
from benchmarks.undeclared.table import table
from bumblebee.errors import BadInput


def _truth(effect="coulomb_friction", where=("elbow",), value=1.0, name="frictionloss"):
    return {"effect": effect, "where": list(where), "parameters": {name: value}, "nominal": {name: 0.0},
            "group": "joint", "ratio": 5.0}  # fmt: skip


def _found(effect="coulomb_friction", where=("elbow",), value=1.1, ci=(0.9, 1.2), name="frictionloss", same=()):
    return {"effect": effect, "where": list(where), "parameters": {name: {"value": value, "ci95": list(ci)}},
            "equivalent": [{"effect": e, "where": [w]} for e, w in same]}  # fmt: skip


def test_an_effect_found_counts_with_its_size_and_interval():
    marks = score([_truth()], {"effects": [_found()]})
    assert marks["top"] and marks["found"] == [True] and marks["spurious"] == 0 and marks["top_place"]
    assert marks["sizes"][0]["relative"] == pytest.approx(0.1) and marks["sizes"][0]["covered"]
    missed = score([_truth()], {"effects": [_found(ci=(1.05, 1.2))]})
    assert not missed["sizes"][0]["covered"]


def test_sizes_are_relative_to_the_change_and_where_it_is_infinite_to_the_value():
    mass = _truth("link_mass", ("fore",), 1.1, "mass") | {"nominal": {"mass": 1.0}}
    marks = score([mass], {"effects": [_found("link_mass", ("fore",), 1.09, (1.0, 1.2), "mass")]})
    assert marks["sizes"][0]["relative"] == pytest.approx(0.1)
    shaft = _truth("series_elasticity", value=600.0, name="stiffness") | {"nominal": {"stiffness": 1e12}}
    marks = score([shaft], {"effects": [_found("series_elasticity", value=660.0, ci=(0, 1e3), name="stiffness")]})
    assert marks["sizes"][0]["relative"] == pytest.approx(0.1)


def test_an_interval_without_an_upper_end_covers_all_above_its_lower_one():
    marks = score([_truth()], {"effects": [_found(ci=(1.05, None))]})
    assert not marks["sizes"][0]["covered"]
    assert score([_truth()], {"effects": [_found(ci=(0.5, None))]})["sizes"][0]["covered"]


def test_a_member_of_a_stated_class_counts_and_another_joint_does_not():
    same = score([_truth()], {"effects": [_found("kd", same=[("coulomb_friction", "elbow")])]})
    assert same["top"] and same["found"] == [True] and same["exact"] == [False]
    other = score([_truth()], {"effects": [_found(where=("wrist",))]})
    assert not other["top"] and other["spurious"] == 1 and not other["top_place"]


def test_a_part_of_a_composite_effect_is_no_false_one_and_no_hit():
    truth = _truth("stribeck_friction", name="stiction")
    marks = score([truth], {"effects": [_found()]})
    assert marks["spurious"] == 0 and marks["found"] == [False]


def test_an_effect_on_a_null_is_an_alarm():
    assert score([], {"effects": [_found()]})["alarm"]
    assert not score([], {"effects": []})["alarm"]


def test_a_strange_effect_needs_flag_joint_and_form():
    truth = _truth("ripple", name="amplitude")
    block = {"significant": True, "where": ["elbow"], "depends_on": ["time"]}
    right = score([truth], {"effects": [], "unexplained": block})["outside"]
    assert right == {"flagged": True, "place": True, "form": True}
    wrong = score([truth], {"effects": [], "unexplained": block | {"depends_on": ["position"]}})["outside"]
    assert wrong == {"flagged": True, "place": True, "form": False}
    silent = score([truth], {"effects": [_found("armature")], "unexplained": {"significant": False}})
    assert not silent["outside"]["flagged"] and silent["spurious"] == 1


def test_a_discovered_term_says_what_it_depends_on():
    truth = _truth("cross_coupling", name="stiffness")
    found = _found("discovered") | {"parameters": {"terms": [{"term": "q[wrist]", "coefficient": -1.0}]}}
    marks = score([truth], {"effects": [found]})
    assert marks["outside"] == {"flagged": True, "place": True, "form": True} and marks["spurious"] == 0
    found["parameters"]["terms"] = [{"term": "sin(3*q)", "coefficient": 0.2}]
    assert not score([truth], {"effects": [found]})["outside"]["form"]


def test_achieved_is_one_for_the_oracle_and_nothing_where_there_is_no_room():
    assert achieved(3.0, 1.0, 1.0) == 1.0 and achieved(3.0, 3.0, 1.0) == 0.0
    assert achieved(1.0, 1.0, 0.99) is None


def test_wilson_is_the_published_interval():
    # Newcombe 1998, table I: 81 of 263 and 0 of 20, method 3.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)


def test_bootstrap_covers_the_median_about_as_often_as_it_says():
    rng = np.random.default_rng(0)
    hits = 0
    for k in range(200):
        low, high = bootstrap(rng.normal(3.0, 1.0, 40), draws=300, seed=k)
        hits += low <= 3.0 <= high
    assert 0.88 <= hits / 200 <= 0.99


def test_evolution_finds_the_bottom_of_a_skewed_bowl():
    scale = np.logspace(0, 2, 6)
    best = evolve(lambda x: (((x - 1.0) * scale) ** 2).sum(axis=1), np.zeros(6), 1.0, 300, np.random.default_rng(0))
    np.testing.assert_allclose(best, 1.0, atol=1e-3)


def _row(case, group, truth, found, unexplained=None, **rest):
    document = {"effects": found, "unexplained": unexplained or {"significant": False}}
    return {"case": case, "robot": "arm", "group": group, "kinds": [t["effect"] for t in truth], "noise": 1.0,
            "rollouts": 4, "version": 1, "seed": 1, "suite": "x", "commit": "c", "truth": truth,
            "ours": score(truth, document) | {"seconds": 2.0}, "achieved": 0.9} | rest  # fmt: skip


def test_the_table_counts_what_the_rows_say(tmp_path, capsys):
    rows = [_row(0, "single", [_truth()], [_found()]), _row(1, "single", [_truth()], []), _row(2, "null", [], [])]
    text = table(rows)
    assert "| single, top-1 up to its class, 5x | 85 % | 95 % | 50 % [9, 91] 1/2 |" in text
    assert "| false alarms on nulls | 5 % | 1 % | 0 % [0, 79] 0/1 |" in text
    assert "| coulomb_friction | 1/2 | 1/2 | 1 x nothing |" in text
    path = tmp_path / "results.jsonl"
    path.write_text("\n".join(json.dumps(r) for r in rows) + '\n{"case": 3, "ro')
    assert len(read_lines(path)) == 3
    assert main(["--table", str(path)]) == 0 and "Cases scored: 3" in capsys.readouterr().out


def test_bad_files_are_one_line_and_status_2(tmp_path, capsys):
    path = tmp_path / "results.jsonl"
    path.write_text('{"case": 1}\nnonsense\n{"case": 2}\n')
    with pytest.raises(BadInput, match="line 2"):
        read_lines(path)
    assert main(["--table", str(path)]) == 2 and len(capsys.readouterr().err.splitlines()) == 1
    assert main(["--table", str(tmp_path / "none")]) == 2
    assert main(["--policy", str(tmp_path), "--limit", "1", "--out", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


def test_cases_are_chosen_by_all_words():
    cases = Suite(1).cases()
    some = [case for case in cases if chosen(case, SimpleNamespace(only=["arm,stand", "null"]))]
    assert some and all(case.group == "null" and case.robot in ("arm", "stand") for case in some)
