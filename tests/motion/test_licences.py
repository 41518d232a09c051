"""The licence is found beside the file, or said to be unknown."""

import pytest

from bumblebee.motion.licences import licence_of


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
