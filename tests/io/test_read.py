"""Files from outside: refused in one line, or read; nothing is expanded or allocated beyond the limits."""

import io
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.read import (
    npz_arrays,
    open_file,
    parse_json,
    parse_yaml,
    read_bytes,
    read_text,
    require_real,
    require_within,
)
from bumblebee.measured.importers.source import open_source
from bumblebee.measured.model_file import load_model


@pytest.mark.parametrize("text", ["[" * 5000 + "]" * 5000, "a: " + "{b: " * 5000, "- " * 5000])
def test_nesting_is_refused_before_anything_recursive_reads_it(text: str):
    with pytest.raises(BadInput, match=r"nesting|YAML"):
        parse_yaml("x", text)


def test_json_that_is_nested_too_deep_is_refused():
    with pytest.raises(BadInput, match="nesting"):
        parse_json("x", "[" * 100_000 + "]" * 100_000)


def test_aliases_that_multiply_are_refused():
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    with pytest.raises(BadInput, match="values"):
        parse_yaml("x", "\n".join(lines))


def test_an_alias_of_itself_is_refused():
    with pytest.raises(BadInput):
        parse_yaml("x", "&a [*a]")


def test_tags_construct_nothing(tmp_path: Path):
    with pytest.raises(BadInput, match="line 1"):
        parse_yaml("x", f"!!python/object/apply:os.mkdir ['{tmp_path / 'made'}']")
    assert not (tmp_path / "made").exists()


def test_nan_is_no_json():
    with pytest.raises(BadInput, match="NaN"):
        parse_json("x", '{"a": NaN}')


@pytest.mark.parametrize(
    ("text", "key"),
    [('{"a": 1, "a": 1}', "a"), ('[{"b": {"c": 1, "d": 2, "c": 3}}]', "c"), ('{"\\u0065": 1, "e": 2}', "e")],
)
def test_json_with_a_key_twice_is_refused_as_yaml_is(text: str, key: str):
    with pytest.raises(BadInput, match=f"x: expected JSON with each key once, came the key '{key}' twice"):
        parse_json("x", text)
    assert parse_json("x", '[{"a": 1}, {"a": {"a": 2}}]') == [{"a": 1}, {"a": {"a": 2}}]


def test_text_that_is_not_utf8_names_its_line(tmp_path: Path):
    (tmp_path / "a").write_bytes(b"one\ntwo \xff\n")
    with pytest.raises(BadInput, match=r"line 2.*0xff"):
        read_text(tmp_path / "a")


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BadInput, match="pipe"):
        read_bytes(tmp_path / "pipe")


def test_a_folder_and_a_large_file_are_refused(tmp_path: Path):
    with pytest.raises(BadInput, match="folder"):
        read_bytes(tmp_path)
    (tmp_path / "a").write_bytes(b"12345")
    with pytest.raises(BadInput, match="at most 4 bytes"):
        read_bytes(tmp_path / "a", 4)


def npz(**arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def test_arrays_come_back_as_they_were():
    made = {"a": np.arange(6.0).reshape(2, 3), "b": np.asfortranarray(np.ones((3, 2), np.float32)), "c": np.array(1)}
    back = npz_arrays("x", npz(**made))
    assert all(np.array_equal(back[key], value) and back[key].dtype == value.dtype for key, value in made.items())


def test_an_archive_that_unpacks_to_too_much_is_refused_by_its_sum():
    limits = Limits(unpacked_bytes=1000)
    with pytest.raises(BadInput, match="unpacks to at most"):
        npz_arrays("x", npz(a=np.zeros(100), b=np.zeros(100)), limits)


def test_a_header_that_claims_gigabytes_allocates_nothing():
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**11,)})
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a.npy", header.getvalue() + bytes(8))
    with pytest.raises(BadInput, match="800,000,000,000 bytes"):
        npz_arrays("x", stream.getvalue())


def test_pickled_objects_are_refused():
    with pytest.raises(BadInput, match="pickled"):
        npz_arrays("x", npz(a=np.array([{}], dtype=object)))


@pytest.mark.parametrize("cut", [0, 1, 10, 60, 200])
def test_a_cut_archive_is_one_line(cut: int):
    with pytest.raises(BadInput):
        npz_arrays("x", npz(a=np.arange(100.0))[:cut])


def test_complex_numbers_and_text_are_not_real():
    for values in (np.array([1j]), np.array(["a"]), np.array([None])):
        with pytest.raises(BadInput, match="real numbers"):
            require_real("x", values)


def test_the_row_of_a_value_that_is_out_of_range_is_named():
    for bad in (np.nan, np.inf, 1e200):
        with pytest.raises(BadInput, match="row 1"):
            require_within("x", np.array([[0.0, 1.0], [0.0, bad]]), 1e6)
    require_within("x", np.zeros((2, 2)), 1.0)


POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 12345\n"


@pytest.mark.parametrize("name", ["a.mcap", "a.xml", "a.parquet", "a.hdf5", "a.zip", "a"])
def test_a_pointer_of_git_lfs_is_named_whatever_its_suffix(tmp_path: Path, name: str):
    (tmp_path / name).write_bytes(POINTER)
    for read in (read_bytes, read_text, open_file, load_model, open_source):
        if read is open_source and name != "a.zip":
            continue  # it names the files of a folder, and opens none but an archive
        with pytest.raises(
            BadInput, match=rf"{name}: expected the file's content, came a Git LFS pointer.*`git lfs pull`"
        ):
            read(tmp_path / name)
    (tmp_path / name).write_bytes(b"version https://git-lfs.github.com/spec/v2")
    assert read_bytes(tmp_path / name).endswith(b"v2")


def test_a_pointer_in_an_archive_is_named(tmp_path: Path):
    with pytest.raises(BadInput, match="a Git LFS pointer"):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            archive.writestr("a.npy", POINTER)
        npz_arrays("a.npz", stream.getvalue())
