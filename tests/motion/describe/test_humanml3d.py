"""HumanML3D's texts come to the motions that they describe, at the times that its index and lines say."""

import re
import time
import zipfile
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.describe.described import ANOTHER_RATE, BEYOND, REVERSED, UNREADABLE
from bumblebee.motion.describe.humanml3d import HumanML3D, read_index
from tests.motion.describe.small_humanml3d import INDEX, TEXTS, put_humanml3d

WALK = Path("cmu_bvh.zip/cmu_bvh/01_01.bvh")
LOOK = Path("Eyes_Japan_Dataset/aita/turn-03-look at-aita_poses.npz")


def times(captions: tuple[str, ...]) -> list[tuple[str, float, float]]:
    return [(text, since, until) for text, _, since, until in map(parse_caption, captions)]


@pytest.mark.parametrize("packed", [True, False])
def test_a_segment_lies_where_the_index_says_and_a_line_within_it_where_the_line_says(tmp_path, packed):
    told = HumanML3D.open(put_humanml3d(tmp_path / "it", packed=packed)).captions(WALK, 30.0)
    assert times(told.captions) == [
        ("a person kicks left", 10.0, 20.0),
        ("they wait", 12.0, 13.5),
        ("a person stands", 0.0, 5.0),
    ]
    assert (told.source, told.licence, told.notes) == ("humanml3d", "MIT", ())


def test_texts_of_the_mirrored_motion_are_given_to_the_mirrored_motion_alone(humanml3d):
    data = HumanML3D.open(humanml3d)
    assert "right" not in "".join(data.captions(WALK, 30.0).captions)
    mirrored = times(data.captions(WALK, 30.0, mirrored=True).captions)
    assert mirrored == [("a person kicks right", 10.0, 20.0), ("a person stands", 0.0, 5.0)]
    texts = {name: text for name, text in TEXTS.items() if name != "000001"}
    told = HumanML3D.open(put_humanml3d(humanml3d, texts=texts)).captions(WALK, 30.0)
    assert len(told.captions) == 2 and told.dropped == (UNREADABLE,)  # not the mirrored text in its place


def test_what_was_cut_from_a_motions_start_is_counted_and_a_time_past_the_segment_means_its_end(humanml3d):
    assert times(HumanML3D.open(humanml3d).captions(LOOK, 30.0).captions) == [("a person looks around", 5.0, 9.0)]


def test_frames_are_those_that_the_index_has_of_a_rate_that_is_no_multiple_of_20(humanml3d):
    data = HumanML3D.open(humanml3d)
    wait = times(data.captions(WALK, 30.0, amass_fps=150.0).captions)[1]
    rate = 150 / 7
    assert wait == ("they wait", round(200 / rate + 2 * 20 / rate, 3), round(200 / rate + 3.5 * 20 / rate, 3))
    assert data.captions(WALK, 30.0, amass_fps=120.0).captions == data.captions(WALK, 30.0).captions


def test_to_the_end_means_the_motions_end(humanml3d):
    path = Path("humanact12/humanact12/P11G01R02F1812T1847A0402.npy")
    assert times(HumanML3D.open(humanml3d).captions(path, 7.25).captions) == [("a person sits", 0.0, 7.25)]


def test_a_caption_beyond_its_motion_is_dropped_with_a_line_and_the_others_are_kept(humanml3d):
    told = HumanML3D.open(humanml3d).captions(WALK, 13.6)
    assert times(told.captions) == [("they wait", 12.0, 13.5), ("a person stands", 0.0, 5.0)]
    assert told.dropped == (BEYOND,)
    assert "01_01.bvh" in told.notes[0] and "within its motion of 13.60 s, came 10 to 20 s" in told.notes[0]


def test_a_range_that_ends_within_a_quarter_second_after_its_motion_is_cut_to_it(humanml3d):
    data = HumanML3D.open(humanml3d)
    assert times(data.captions(WALK, 19.8).captions)[0] == ("a person kicks left", 10.0, 19.8)
    assert data.captions(WALK, 19.7).dropped == (BEYOND,)


def test_an_smplx_file_whose_rate_is_not_the_indexs_gets_no_text(humanml3d):
    told = HumanML3D.open(humanml3d).captions(Path("CMU/01/01_01_stageii.npz"), 15.0)
    assert told.captions == () and told.source == "" and told.licence == ""
    assert set(told.dropped) == {ANOTHER_RATE} and len(told.dropped) == 3 and len(told.notes) == 1


def test_an_ambiguous_motion_gets_no_text_and_a_note(humanml3d):
    told = HumanML3D.open(humanml3d).captions(Path("cmu/18_13.bvh"), 10.0)
    assert told.captions == () and told.dropped == () and "18_19_Justin" in told.notes[0]


def test_a_line_that_is_no_caption_costs_itself_alone(humanml3d):
    texts = TEXTS | {"000001": "no hash\na#b/X#3.0#2.0\nc#d/X#2.0#2.0\ne\x1b#f/X#0#0\na person stands#x/Y#0.0#0.0\n"}
    told = HumanML3D.open(put_humanml3d(humanml3d, texts=texts)).captions(WALK, 30.0)
    assert [text for text, *_ in times(told.captions)] == ["a person kicks left", "they wait", "a person stands"]
    assert told.dropped == (UNREADABLE, REVERSED, REVERSED, UNREADABLE)
    assert "000001.txt, line 1" in told.notes[0] and all(note.isprintable() for note in told.notes)


@pytest.mark.parametrize("column", ["source_path", "start_frame", "end_frame", "new_name"])
def test_an_index_without_a_column_is_one_line(humanml3d, column):
    (humanml3d / "index.csv").write_text(INDEX.replace(column, "other"))
    with pytest.raises(BadInput, match=rf"index\.csv: expected the columns .* came no {column}"):
        HumanML3D.open(humanml3d)


def test_a_bad_row_of_the_index_is_one_line_and_costs_no_other(tmp_path):
    rows = [
        "./pose_data/KIT/3/a_poses.npy,0,100,000010.npy",
        "./pose_data/KIT/3/a_poses.npy,0,100,000010.npy",  # the same name again
        "./pose_data/KIT/3/a_stageii.npy,0,100,000011.npy",  # another path that reads the same
        "./pose_data/KIT/3/b_poses.npy,9,3,000012.npy",
        "./pose_data/KIT/3/b_poses.npy,0,x,000013.npy",
        "./pose_data/KIT/3/b_poses.npy,0,9,../../etc/passwd",
        "../../KIT,0,9,000014.npy",
        '"./pose_data/KIT/3/c_poses.npy,0,9,000015.npy',
        "./pose_data/KIT/3/b_poses.npy,0,9",
    ]
    (tmp_path / "index.csv").write_text("\n".join(["source_path,start_frame,end_frame,new_name", *rows]))
    segments, bad = read_index(tmp_path / "index.csv")
    assert [len(found) for found in segments.values()] == [1]
    assert [int(re.search(r"line (\d+)", line)[1]) for line in bad] == list(range(3, 11))


def test_a_truncated_archive_is_one_line(humanml3d):
    whole = (humanml3d / "texts.zip").read_bytes()
    for length in (0, 100, len(whole) // 2, len(whole) - 1):
        (humanml3d / "texts.zip").write_bytes(whole[:length])
        with pytest.raises(BadInput, match=r"texts\.zip: expected a zip archive"):
            HumanML3D.open(humanml3d)


def test_a_damaged_text_costs_itself_alone(humanml3d):
    data = bytearray((humanml3d / "texts.zip").read_bytes())
    data[50:60] = b"\xff" * 10  # within the first member's packed bytes
    (humanml3d / "texts.zip").write_bytes(data)
    told = HumanML3D.open(humanml3d).captions(WALK, 30.0)
    assert [text for text, *_ in times(told.captions)] == ["a person stands"] and told.dropped == (UNREADABLE,)


def test_a_text_that_says_it_has_a_gigabyte_is_not_unpacked(humanml3d):
    with zipfile.ZipFile(humanml3d / "texts.zip") as archive:
        size = archive.getinfo("texts/000001.txt").file_size
    data = bytearray((humanml3d / "texts.zip").read_bytes())
    at = data.rindex(b"texts/000001.txt") - 46  # its entry in the archive's list
    assert int.from_bytes(data[at + 24 : at + 28], "little") == size
    data[at + 24 : at + 28] = (1 << 30).to_bytes(4, "little")
    (humanml3d / "texts.zip").write_bytes(data)
    with pytest.raises(BadInput, match="unpacks to at most"):
        HumanML3D.open(humanml3d)
    data[at + 24 : at + 28] = (900 << 20).to_bytes(4, "little")
    (humanml3d / "texts.zip").write_bytes(data)
    told = HumanML3D.open(humanml3d).captions(WALK, 30.0)
    assert len(told.captions) == 2 and told.dropped == (UNREADABLE,)
    assert "000001.txt: expected at most 1,048,576 bytes unpacked" in told.notes[0]


def test_an_archive_with_an_endless_list_of_files_is_refused_before_it_is_read(humanml3d):
    data = bytearray((humanml3d / "texts.zip").read_bytes())
    at = data.rindex(b"PK\x05\x06")
    data[at + 12 : at + 16] = b"\xff" * 4  # as in zip64, too
    (humanml3d / "texts.zip").write_bytes(data)
    with pytest.raises(BadInput, match="a list of files of at most"):
        HumanML3D.open(humanml3d)


def test_entries_that_climb_out_or_come_twice_are_never_read(humanml3d, tmp_path):
    with zipfile.ZipFile(humanml3d / "texts.zip", "w") as archive:
        for name in ("texts/../../000000.txt", "/texts/000000.txt", "texts/000000.txt.exe", "__MACOSX/texts/._1"):
            archive.writestr(name, "from outside#x/Y#0#0")
        archive.writestr("texts/000001.txt", "once#x/Y#0#0")
        with pytest.warns(UserWarning, match="Duplicate name"):
            archive.writestr("texts/000001.txt", "twice#x/Y#0#0")
    data = HumanML3D.open(humanml3d)
    told = data.captions(WALK, 30.0)
    assert told.captions == () and told.dropped == (UNREADABLE, UNREADABLE)
    assert "3 files in it that are no texts" in data.notes[0] and "1 texts twice" in data.notes[1]
    assert {path.name for path in tmp_path.rglob("*")} == {"humanml3d", "index.csv", "texts.zip"}


def test_an_entry_without_a_name_costs_no_other(humanml3d):
    with zipfile.ZipFile(humanml3d / "texts.zip", "a") as archive:
        archive.writestr("Q", "")
    data = bytearray((humanml3d / "texts.zip").read_bytes())
    at = data.rindex(b"Q") - 46  # its entry in the list: no byte of name, one of extra data
    data[at + 28 : at + 32] = b"\0\0\1\0"
    (humanml3d / "texts.zip").write_bytes(data)
    opened = HumanML3D.open(humanml3d)
    assert len(opened.captions(WALK, 30.0).captions) == 3 and "1 files in it" in opened.notes[0]


def test_a_folder_without_texts_is_one_line(tmp_path):
    (tmp_path / "index.csv").write_text(INDEX)
    with pytest.raises(BadInput, match=r"texts\.zip or a folder texts"):
        HumanML3D.open(tmp_path)


def test_a_stated_licence_beside_the_texts_is_theirs(humanml3d):
    (humanml3d / "LICENSE").write_text("Creative Commons Attribution-NonCommercial 4.0")
    assert HumanML3D.open(humanml3d).captions(WALK, 30.0).licence == "CC-BY-NC-4.0"


@pytest.fixture(scope="module")
def real(shared: Path) -> HumanML3D:
    return HumanML3D.open(shared / "text" / "humanml3d")


def test_the_published_index_is_read_whole(real):
    assert len(real.segments) == 11_715 and sum(map(len, real.segments.values())) == 14_616
    assert real.bad_rows == () and real.notes == () and real.licence == "MIT"


def test_cmu_has_111_segments_with_texts_and_none_beyond_its_motion(real, shared):
    segments, captions = [], []
    with zipfile.ZipFile(shared / "motions" / "cmu_bvh.zip") as archive:
        for name in (name for name in archive.namelist() if name.endswith(".bvh")):
            with archive.open(name) as stream:
                frames = int(re.search(rb"Frames:\s*(\d+)", stream.read(60_000))[1])
            told = real.captions(Path("cmu_bvh.zip") / name, (frames - 2) / 120)  # without the T-pose in front
            assert told.dropped == told.notes == ()
            stem = Path(name).stem
            segments.append(len(real.segments.get(("CMU", stem[: stem.index("_")], stem), ())))
            captions.append(len(told.captions))
            assert (segments[-1] > 0) == (captions[-1] > 0)
    assert (sum(map(bool, segments)), sum(segments), sum(captions)) == (95, 111, 332)


def test_8179_motions_are_joined_within_seconds(real):
    """0.5 s on 2.5 GHz; the bound leaves room for a busy machine and none for a search through all rows."""
    paths = [Path("amass", key[0], key[1], f"{key[2]}_poses.npz") for key in list(real.segments)[:8179]]
    start = time.process_time()
    told = [real.captions(path, 300.0) for path in paths]
    assert time.process_time() - start < 4 and all(one.captions for one in told)


def test_the_published_lines_are_used_but_for_four_that_end_before_they_start(real):
    told = [real.captions(Path("amass", *key[:2], f"{key[2]}_poses.npz"), 3600.0) for key in real.segments]
    assert sum(len(one.captions) for one in told) == 43_688
    assert [kind for one in told for kind in one.dropped] == [REVERSED] * 4
