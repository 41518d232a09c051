"""The licence is found beside the file, or said to be unknown."""

import zipfile
from pathlib import Path

import pytest

from bumblebee.motion.licences.of_files import licence_of, stated_rate
from bumblebee.motion.licences.terms import counted, noncommercial, restrictions
from bumblebee.motion.reading.walk import motion_sources


@pytest.mark.parametrize(
    ("name", "text", "licence"),
    [
        ("LICENSE", "MIT License\n\nCopyright", "MIT"),
        ("LICENCE.txt", "Apache License\nVersion 2.0", "Apache-2.0"),
        ("LICENSE.md", "Creative Commons Attribution-NonCommercial 4.0", "CC-BY-NC-4.0"),
        ("LICENSE", "All rights reserved", "see LICENSE"),
        ("NOTES", "MIT License", "unknown"),
    ],
)
def test_a_licence_file_beside_the_motion(tmp_path, name, text, licence):
    (tmp_path / name).write_text(text)
    assert licence_of(tmp_path / "walk.csv") == licence


def test_a_row_of_sources_md_goes_before_the_file(tmp_path):
    (tmp_path / "SOURCES.md").write_text(
        "| folder | what | licence |\n|---|---|---|\n| `m/other` | x | MIT |\n| `m/walks` | x | CC BY 4.0: name us |\n"
    )
    (tmp_path / "m/walks").mkdir(parents=True)
    (tmp_path / "m/walks/LICENSE").write_text("MIT License")
    assert licence_of(tmp_path / "m/walks/a.csv") == "CC BY 4.0: name us"
    (tmp_path / "m/runs").mkdir()
    assert licence_of(tmp_path / "m/runs/a.csv") == "unknown"


TABLE = """# Where it is from

| folder | what | licence |
|---|---|---|
| `m/other` | 30 Hz, written at 60 Hz | MIT |
| `m/walks` | CSV at 60 Hz, 36 columns | CC BY 4.0 |
| `m/all.zip` | marker mocap, 120 Hz; 106 files | free, not to resell |
| `m/walks/one.csv` | cut out of it; 29.97 Hz | Apache-2.0 |
| `m/range` | 30 to 60 Hz | MIT |

| other | 50 Hz |
"""


def archive(path: Path, **files: str) -> Path:
    with zipfile.ZipFile(path, "w") as out:
        for name in ("a.bvh", "in/b.bvh", "in/deep/c.bvh"):
            out.writestr(name, "x")
        for name, text in files.items():
            out.writestr(name.replace("__", "/"), text)
    return path


def licences(path: Path) -> dict[str, str]:
    return {source.path.name: licence_of(source.path, source.archive) for source in motion_sources(path)}


def test_the_row_that_names_a_folder_file_or_archive_is_its_own(tmp_path):
    (tmp_path / "SOURCES.md").write_text(TABLE)
    for folder in ("m/walks/deep", "m/other", "m/range", "m/new"):
        (tmp_path / folder).mkdir(parents=True)
    archive(tmp_path / "m/all.zip")
    files = ("walks/a.csv", "walks/deep/a.csv", "walks/one.csv", "other/a.csv", "range/a.csv", "new/a.csv", "a.csv")
    found = {name: (licence_of(tmp_path / "m" / name), stated_rate(tmp_path / "m" / name)) for name in files}
    assert found == {
        "walks/a.csv": ("CC BY 4.0", 60),
        "walks/deep/a.csv": ("CC BY 4.0", 60),
        "walks/one.csv": ("Apache-2.0", 29.97),
        "other/a.csv": ("MIT", None),
        "range/a.csv": ("MIT", None),
        "new/a.csv": ("unknown", None),
        "a.csv": ("unknown", None),
    }
    for source in motion_sources(tmp_path / "m/all.zip"):
        assert (licence_of(source.path, source.archive), stated_rate(source.path, source.archive)) == (
            "free, not to resell",
            120,
        )


def test_a_licence_file_named_after_an_archive_is_that_of_its_members(tmp_path):
    archive(tmp_path / "walks.zip", LICENSE="Apache License")
    (tmp_path / "walks.LICENCE.txt").write_text("MIT License")
    (tmp_path / "LICENSE").write_text("CC0")
    assert set(licences(tmp_path / "walks.zip").values()) == {"MIT"}


def test_a_licence_in_an_archive_is_that_of_its_folder_and_those_below(tmp_path):
    path = archive(tmp_path / "walks.zip", LICENSE="MIT License", in__deep__COPYING="All mine")
    assert licences(path) == {"a.bvh": "MIT", "b.bvh": "MIT", "c.bvh": "see COPYING"}


def test_a_member_of_an_archive_without_any_has_the_licence_of_the_folder(tmp_path):
    (tmp_path / "LICENSE").write_text("Creative Commons Attribution-NonCommercial")
    assert set(licences(archive(tmp_path / "walks.zip")).values()) == {"CC-BY-NC-4.0"}


def test_a_row_that_names_only_the_folder_gives_way_to_a_file_named_after_the_archive(tmp_path):
    (tmp_path / "SOURCES.md").write_text("| folder | licence |\n|---|---|\n| `m` | Apache-2.0 |\n")
    (tmp_path / "m").mkdir()
    (tmp_path / "m/walks.LICENSE.txt").write_text("MIT License")
    assert set(licences(archive(tmp_path / "m/walks.zip")).values()) == {"MIT"}
    assert set(licences(archive(tmp_path / "m/runs.zip")).values()) == {"Apache-2.0"}


def test_a_text_of_no_known_licence_that_forbids_commercial_use_says_so(tmp_path):
    (tmp_path / "LICENSE.txt").write_text("for non-commercial\nscientific research purposes")
    licence = licence_of(tmp_path / "a.npz")
    assert licence == "non-commercial, see LICENSE.txt" and noncommercial(licence)
    (tmp_path / "other").mkdir()
    (tmp_path / "other/COPYING").write_text("GNU General Public License ... only for noncommercial distribution")
    assert noncommercial(licence_of(tmp_path / "other/a.npz")) is False


@pytest.mark.parametrize(
    ("licence", "forbids"),
    [
        ("CC-BY-NC-4.0", True),
        ("CC BY-NC-SA 4.0: name us", True),
        ("AMASS licence: non-commercial scientific research", True),
        ("NonCommercial", True),
        ("free for research use only", True),
        ("MIT", False),
        ("Apache-2.0 / BSD-3; facts, free to carry over", False),
        ("CC BY 4.0 (as its card says)", False),
        ("CC-BY-SA-4.0", False),
        ("CC0-1.0", False),
        ("public domain", False),
        ("GPL-3.0", False),
        ("unknown", None),
        ("see LICENSE", None),
        ("free to use and redistribute, not to resell", None),
        ("permitted", None),
        ("", None),
    ],
)
def test_whether_a_licence_forbids_commercial_use(licence, forbids):
    assert noncommercial(licence) is forbids


def test_what_speaks_against_commercial_use_is_said_and_nothing_where_all_allow_it():
    assert restrictions(counted(["MIT", "Apache-2.0", "CC BY 4.0"])) == []
    counts = counted(["MIT", "CC-BY-NC-4.0", "see LICENSE", None, "", "CC-BY-NC-4.0", "unknown"])
    assert counts == {"unknown": 3, "CC-BY-NC-4.0": 2, "MIT": 1, "see LICENSE": 1}
    assert restrictions(counts) == [
        "trained on motions that may not be used commercially: CC-BY-NC-4.0",
        "read these licences before commercial use, whose names do not settle it: see LICENSE",
        "licence unknown for 3 motions: ask before commercial use",
    ]
    assert restrictions({"unknown": 1}) == ["licence unknown for 1 motion: ask before commercial use"]
