"""Members of archives are read without unpacking; what is wrong with one costs that one, and is one line."""

import gzip
import io
import pickle
import stat
import struct
import tarfile
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.reading import archives
from bumblebee.motion.reading.walk import motion_sources

MOST = 1 << 30
GOOD = {"walks/b.bvh": b"b" * 70_000, "walks/a.csv": b"a" * 3_000, "c.npz": b"c"}


def make_zip(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def mode(path: Path) -> str:
    return {".tar": "w", ".bz2": "w:bz2"}.get(path.suffix, "w:gz")


def make_tar(path: Path, files: dict[str, bytes], *others: tarfile.TarInfo) -> Path:
    with tarfile.open(path, mode(path)) as archive:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
        for info in others:
            archive.addfile(info)
    return path


MAKERS = pytest.mark.parametrize(
    ("make", "name"),
    [(make_zip, "m.zip"), (make_tar, "m.tar"), (make_tar, "m.tar.gz"), (make_tar, "M.TGZ"), (make_tar, "m.tar.bz2")],
)


def outcome(path: Path) -> tuple[dict[str, bytes], list[str]]:
    """Readable members below a path, and the lines about what cannot be read."""
    read, lines = {}, []
    for source in motion_sources(path):
        try:
            read[str(source.path.relative_to(path) if source.path != path else "")] = source.read(MOST)
        except BadInput as error:
            lines.append(str(error))
            assert str(error).isprintable() and len(str(error)) < 500
    return read, lines


@MAKERS
def test_members_are_read_as_they_were_written(tmp_path, make, name):
    assert outcome(make(tmp_path / name, GOOD)) == (GOOD, [])
    assert sorted(path.name for path in tmp_path.iterdir()) == [name]


@MAKERS
def test_members_are_read_in_any_order_and_in_another_process(tmp_path, make, name):
    sources = list(motion_sources(make(tmp_path / name, GOOD)))[::-1]
    for source in pickle.loads(pickle.dumps(sources)) + sources:
        assert source.read(MOST) == GOOD[str(source.path.relative_to(tmp_path / name))]
        assert source.archive == tmp_path / name


@MAKERS
def test_what_is_no_motion_is_passed_over(tmp_path, make, name):
    files = {
        **GOOD,
        "LICENSE": b"x",
        "notes.txt": b"x",
        "__MACOSX/a.bvh": b"x",
        ".hidden.bvh": b"x",
        "d/.e/a.bvh": b"x",
    }
    assert outcome(make(tmp_path / name, files)) == (GOOD, [])


@MAKERS
@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ("../out.bvh", "climbs out"),
        ("a/../../out.bvh", "climbs out"),
        ("..\\out.bvh", "climbs out"),
        ("/etc/out.bvh", "climbs out"),
        ("C:\\out.bvh", "climbs out"),
        ("../../etc/passwd", "climbs out"),
        ("walks/..", "climbs out"),
        ("inner.zip", "an archive in an archive"),
        ("inner.tar.gz", "an archive in an archive"),
    ],
)
def test_a_bad_name_costs_that_member_only(tmp_path, make, name, bad, words):
    read, lines = outcome(make(tmp_path / name, {bad: b"x", **GOOD}))
    assert read == GOOD and len(lines) == 1 and words in lines[0]
    for source in motion_sources(tmp_path / name):
        assert tmp_path / name in (source.path, *source.path.parents) and ".." not in source.path.parts


@MAKERS
def test_two_members_of_one_name_are_one_line(tmp_path, make, name):
    with pytest.warns(UserWarning, match="Duplicate") if make is make_zip else pytest.MonkeyPatch.context():
        path = make(tmp_path / name, {"x.bvh": b"1", "y.bvh": b"2"})
        if make is make_zip:
            with zipfile.ZipFile(path, "a") as archive:
                archive.writestr("./x.bvh", b"3")
                archive.writestr("y.bvh", b"4")
        else:
            with tarfile.open(path, mode(path)) as archive:
                for member in ("x.bvh", "y.bvh", "./x.bvh", "y.bvh"):
                    archive.addfile(tarfile.TarInfo(member), io.BytesIO())
    read, lines = outcome(path)
    assert read == {} and len(lines) == 2 and all("one member of each name, came two" in line for line in lines)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (tarfile.SYMTYPE, "a link"),
        (tarfile.LNKTYPE, "a link"),
        (tarfile.CHRTYPE, "a device"),
        (tarfile.FIFOTYPE, "a device"),
    ],
)
def test_links_and_devices_of_a_tar_are_one_line(tmp_path, kind, words):
    info = tarfile.TarInfo("x.bvh")
    info.type, info.linkname = kind, "/etc/passwd"
    read, lines = outcome(make_tar(tmp_path / "m.tar", GOOD, info))
    assert read == GOOD and len(lines) == 1 and words in lines[0]


def test_links_of_a_zip_are_one_line(tmp_path):
    path, info = make_zip(tmp_path / "m.zip", GOOD), zipfile.ZipInfo("x.bvh")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(info, "/etc/passwd")
    read, lines = outcome(path)
    assert read == GOOD and len(lines) == 1 and "a link" in lines[0]


def test_a_member_with_a_password_is_one_line(tmp_path):
    data = bytearray(make_zip(tmp_path / "m.zip", {"x.bvh": b"1"}).read_bytes())
    data[data.index(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "m.zip").write_bytes(data)
    assert "without password" in outcome(tmp_path / "m.zip")[1][0]


def test_a_member_that_says_too_little_or_too_much_is_one_line(tmp_path):
    for said in (5, 70_001, 0xFFFFFFF0):
        data = bytearray(make_zip(tmp_path / "m.zip", GOOD).read_bytes())
        struct.pack_into("<I", data, data.index(b"PK\x01\x02") + 24, said)
        (tmp_path / f"{said}.zip").write_bytes(data)
        read, lines = outcome(tmp_path / f"{said}.zip")
        assert len(read) == 2 and len(lines) == 1


def test_a_member_that_unpacks_to_a_thousand_times_its_size_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(archives.member_bytes, "__defaults__", (replace(archives.LIMITS, ratio=100, free_bytes=5000),))
    read, lines = outcome(make_zip(tmp_path / "m.zip", {**GOOD, "bomb.bvh": bytes(10_000_000), "walks/b.bvh": b"b"}))
    assert len(read) == 3 and len(lines) == 1 and "100 times its packed size" in lines[0]


def test_a_member_that_says_it_is_packed_into_nothing_is_one_line(tmp_path):
    data = bytearray(make_zip(tmp_path / "m.zip", GOOD).read_bytes())
    at = data.index(b"PK\x01\x02")
    struct.pack_into("<II", data, at + 20, 0, 500_000_000)
    (tmp_path / "m.zip").write_bytes(data)
    read, lines = outcome(tmp_path / "m.zip")
    assert len(read) == 2 and len(lines) == 1 and "times its packed size" in lines[0]


@MAKERS
def test_more_than_is_asked_for_is_refused_before_it_is_unpacked(tmp_path, make, name):
    sources = {source.path.name: source for source in motion_sources(make(tmp_path / name, GOOD))}
    with pytest.raises(BadInput, match="at most 69,999 bytes, came 70,000"):
        sources["b.bvh"].read(69_999)


@MAKERS
def test_an_archive_of_too_many_or_too_large_members_is_one_line(tmp_path, monkeypatch, make, name):
    for number, limits in enumerate(
        (replace(archives.ARCHIVE, members=2), replace(archives.ARCHIVE, unpacked_bytes=9))
    ):
        monkeypatch.setattr(archives, "ARCHIVE", limits)
        lines = outcome(make(tmp_path / f"{number}{name}", GOOD))[1]
        assert len(lines) == 1 and "members of" in lines[0]


def test_a_truncated_zip_is_one_line(tmp_path):
    whole = make_zip(tmp_path / "m.zip", GOOD).read_bytes()
    for number, length in enumerate(range(0, len(whole) - 1, 20)):
        path = tmp_path / f"{number}.zip"
        path.write_bytes(whole[:length])
        read, lines = outcome(path)
        assert read == {} and len(lines) == 1 and "a whole zip archive" in lines[0]


@pytest.mark.parametrize("name", ["m.tar", "m.tar.gz", "m.tar.bz2"])
def test_of_a_truncated_tar_the_whole_members_are_read(tmp_path, name):
    whole = make_tar(tmp_path / name, GOOD).read_bytes()
    counts = set()
    for number, length in enumerate(range(0, len(whole) - 1, max(1, len(whole) // 200))):
        path = tmp_path / f"{number}{name}"
        path.write_bytes(whole[:length])
        read, lines = outcome(path)
        # The last 10 kB of a tar are empty blocks: without some of them nothing is lost.
        assert (read == GOOD and not lines) or any("a whole tar archive" in line for line in lines)
        assert all(GOOD[member] == data for member, data in read.items())
        counts.add(len(read))
    # One block of bzip2 holds all of it: here nothing comes before the whole block.
    assert counts == ({0, 3} if name == "m.tar.bz2" else {0, 1, 2, 3})


def test_a_damaged_header_in_a_tar_is_one_line_and_not_its_end(tmp_path):
    data = bytearray(make_tar(tmp_path / "m.tar", {"a.bvh": b"1", "b.bvh": b"2", "c.bvh": b"3"}).read_bytes())
    data[1024 + 150] ^= 0xFF
    (tmp_path / "m.tar").write_bytes(data)
    read, lines = outcome(tmp_path / "m.tar")
    assert read == {"a.bvh": b"1"} and len(lines) == 1 and "1 members, then" in lines[0]


def test_a_tar_whose_header_asks_for_a_gigabyte_gets_none(tmp_path):
    info = tarfile.TarInfo("pax")
    info.type, info.size = tarfile.XHDTYPE, 1 << 30
    with gzip.open(tmp_path / "m.tar.gz", "wb") as stream:
        stream.write(info.tobuf() + bytes(1 << 20))
    assert "a header of" in outcome(tmp_path / "m.tar.gz")[1][0]


@pytest.mark.parametrize("name", ["m.zip", "m.tar", "m.tar.gz", "m.tbz2"])
def test_what_is_no_archive_is_one_line(tmp_path, name):
    (tmp_path / name).write_bytes(b"PK\x05\x06 this is none " * 100)
    read, lines = outcome(tmp_path / name)
    assert read == {} and len(lines) == 1


def test_a_changed_archive_is_listed_anew(tmp_path):
    assert set(outcome(make_zip(tmp_path / "m.zip", GOOD))[0]) == set(GOOD)
    assert outcome(make_zip(tmp_path / "m.zip", {"new.bvh": b"new"})) == ({"new.bvh": b"new"}, [])


def test_files_and_archives_of_a_folder_come_in_the_order_of_names(tmp_path):
    (tmp_path / "z.csv").write_bytes(b"z")
    (tmp_path / "a.csv").write_bytes(b"a")
    make_zip(tmp_path / "m.zip", GOOD)
    found = [str(source.path.relative_to(tmp_path)) for source in motion_sources(tmp_path)]
    assert found == ["a.csv", "m.zip/c.npz", "m.zip/walks/a.csv", "m.zip/walks/b.bvh", "z.csv"]
