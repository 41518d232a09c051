"""A person's word about single motions is read whole or not at all, and never applies in silence to another motion."""

from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.filters.decisions import (
    DECISION_COLUMNS,
    OVERRULED,
    Decision,
    accounting,
    decisions_table,
    drops_table,
)
from bumblebee.motion.filters.overrule import Overrule, by_clip, read_overrules

HEADER = "motion,decision,reason,who\n"
LIBRARY = ["walk", "kick_p0", "kick_p1", "crawl"]


def written(tmp_path: Path, text: str, name: str = "overrule.csv") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def line(path: Path, names: list[str] | None = None) -> str:
    with pytest.raises(BadInput) as caught:
        by_clip(read_overrules(path), names or LIBRARY, path)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def test_csv_and_yaml_say_the_same_in_any_order_of_columns(tmp_path: Path):
    table = written(tmp_path, 'who,motion,decision,reason\nAda,walk,drop,"limps, badly"\n')
    listed = written(tmp_path, "- {motion: walk, decision: drop, reason: 'limps, badly', who: Ada}\n", "o.yaml")
    wanted = ("walk", "drop", "limps, badly", "Ada")
    for path in (table, listed):
        (one,) = read_overrules(path)
        assert (one.motion, one.decision, one.reason, one.who) == wanted


def test_the_name_of_a_motion_that_was_cut_holds_for_all_its_pieces(tmp_path: Path):
    path = written(tmp_path, HEADER + "kick,keep,looked at it,Ada\n")
    assert list(by_clip(read_overrules(path), LIBRARY, path)) == ["kick_p0", "kick_p1"]


def test_an_unknown_motion_is_refused_with_the_nearest_names(tmp_path: Path):
    said = line(written(tmp_path, HEADER + "walk,keep,fine,Ada\nwakl,drop,bad,Ada\nzzz,drop,bad,Ada\n"))
    assert "row 3" in said and "'wakl'; the nearest: walk" in said and "rows 4" in said


@pytest.mark.parametrize(
    ("rows", "wanted"),
    [
        ("walk,keep,fine,Ada\nwalk,drop,bad,Bob\n", "row 3: walk: expected one row for each motion"),
        ("walk,keep,fine,Ada\nwalk,keep,fine,Bob\n", "one row for each motion"),
        ("kick,keep,fine,Ada\nkick_p1,drop,bad,Bob\n", "kick_p1: expected one decision for a motion and its pieces"),
        ("walk,maybe,fine,Ada\n", "keep or drop"),
        ("walk,keep,,Ada\n", "reason without text"),
        ("walk,keep,fine\n", "who without text"),
        ("walk,keep,fine,Ada,more\n", "more than that"),
        ('walk,keep,"fine\nor not",Ada\n', "one line of text"),
        ('walk,keep,"fine,Ada\n', "a CSV file"),
    ],
)
def test_rows_that_contradict_or_are_not_complete_are_one_line(tmp_path: Path, rows: str, wanted: str):
    assert wanted in line(written(tmp_path, HEADER + rows))


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("motion,decision\nwalk,keep\n", "a.csv"),
        ("", "b.csv"),
        ("walk: keep\n", "c.yaml"),
        ("- walk\n", "d.yml"),
        ("- {motion: walk, decision: true, reason: a, who: b}\n", "e.yaml"),
    ],
)
def test_files_of_another_form_are_one_line(tmp_path: Path, text: str, name: str):
    assert name in line(written(tmp_path, text, name))


def test_no_file_is_one_line(tmp_path: Path):
    assert "no such file" in line(tmp_path / "nowhere.csv")


def broken(motion: str, *rules: str) -> tuple[dict[str, object], ...]:
    return tuple({"motion": motion, "rule": rule, "value": 2.0, "limit": 1.0, "explanation": "why"} for rule in rules)


DECISIONS = [
    Decision("good"),
    Decision("bad", broken("bad", "floating", "skate")),
    Decision("worse", broken("worse", "skate")),
    Decision("saved", broken("saved", "skate"), Overrule("saved", "keep", "it is meant to slide", "Ada", 2)),
    Decision("ugly", (), Overrule("ugly", "drop", "limps", "Bob", 3)),
    Decision("both", broken("both", "floating"), Overrule("both", "drop", "and limps", "Bob", 4)),
]


def test_the_counts_add_up():
    counts = accounting(DECISIONS)
    assert (counts.read, counts.kept, counts.dropped) == (6, 2, 4)
    assert counts.by_first_reason == {"floating": 2, "skate": 1, OVERRULED: 1}
    assert sum(counts.by_first_reason.values()) == counts.dropped
    assert counts.by_rule == {"skate": 3, "floating": 2}
    assert (counts.kept_by_word, counts.dropped_by_word) == (1, 1)


def test_an_overruled_motion_is_listed_with_both_verdicts_and_the_word():
    table = decisions_table(DECISIONS)
    assert tuple(table.columns) == DECISION_COLUMNS
    assert table["motion"].tolist() == [one.motion for one in DECISIONS]
    saved = table.set_index("motion").loc["saved"]
    assert (saved["decision"], saved["by_rules"], saved["rules"]) == ("keep", "drop", "skate")
    assert (saved["overruled_by"], saved["overruled_because"]) == ("Ada", "it is meant to slide")


def test_drops_are_those_that_were_dropped_and_a_persons_says_who():
    drops = drops_table(DECISIONS)
    assert drops["motion"].tolist() == ["bad", "bad", "worse", "ugly", "both"]
    ugly = drops.set_index("motion").loc["ugly"]
    assert (ugly["rule"], ugly["explanation"]) == (OVERRULED, "Bob: limps")
