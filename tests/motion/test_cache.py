"""An entry is not made again, unless it is damaged, was cleared, or would come out another way."""

import multiprocessing
import os
from pathlib import Path

import numpy as np
import pytest

from bumblebee.motion import cache
from bumblebee.motion.cache import cached, key_of


def entry(number: int = 0, size: int = 50) -> dict[str, np.ndarray]:
    values = np.arange(size, dtype=np.float32).reshape(-1, 5) + number
    return {"root_pos": values, "contact": values > 3, "frames": np.array(size)}


class Maker:
    """Makes an entry and counts how often."""

    def __init__(self, number: int = 0, size: int = 50) -> None:
        self.calls, self.number, self.size = 0, number, size

    def __call__(self) -> dict[str, np.ndarray]:
        self.calls += 1
        return entry(self.number, self.size)


def key(number: int = 0) -> str:
    return key_of({"file": f"{number:064x}", "settings": {"fps": 50.0}, "code": 1})


def path_of(folder: Path, number: int = 0) -> Path:
    return folder / key(number)[:2] / f"{key(number)[2:]}.npz"


def test_what_is_there_is_not_made_again_and_comes_back_as_it_was(tmp_path):
    make = Maker()
    for found in (cached(tmp_path, key(), make), cached(tmp_path, key(), make)):
        assert found.keys() == entry().keys()
        for name, values in entry().items():
            np.testing.assert_array_equal(found[name], values)
            assert found[name].dtype == values.dtype
    assert make.calls == 1
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [path_of(tmp_path)]


def test_of_many_motions_the_changed_one_is_made_again(tmp_path):
    makers = [Maker(number) for number in range(5)]
    for number, make in enumerate(makers):
        cached(tmp_path, key(number), make)
    for number, make in enumerate(makers):
        cached(tmp_path, key(99 if number == 2 else number), make)
    assert [make.calls for make in makers] == [1, 1, 2, 1, 1]


def test_a_key_says_everything_and_not_the_order():
    parts = {"file": "ab", "settings": {"fps": 50.0, "feet": [1, 2]}, "code": 3}
    assert key_of(parts) == key_of(dict(reversed(parts.items()))) and len(key_of(parts)) == 64
    others = [
        {**parts, "code": 4},
        {**parts, "code": "3"},
        {**parts, "file": "ac"},
        {**parts, "settings": {"fps": 50.0, "feet": [2, 1]}},
        {**parts, "more": None},
    ]
    assert len({key_of(other) for other in [parts, *others]}) == 6


@pytest.mark.parametrize("value", [{1, 2}, object(), Path("a"), {1: 2}, float("nan"), b"x", np.float32(1)])
def test_what_has_no_one_form_is_no_part_of_a_key(value):
    with pytest.raises((TypeError, ValueError)):
        key_of({"settings": {"x": [value]}})


@pytest.mark.parametrize("cut", ["a bit", "half", "empty", "no archive", "a folder", "another entry's"])
def test_a_damaged_entry_is_made_again(tmp_path, cut):
    cached(tmp_path, key(), Maker())
    path = path_of(tmp_path)
    data = bytearray(path.read_bytes())
    if cut == "a bit":
        data[data.index(np.float32(7).tobytes())] ^= 1
        with pytest.MonkeyPatch.context() as patch:  # also where the archive's own check does not notice
            patch.setattr("zipfile.ZipExtFile._update_crc", lambda *_: None)
            path.write_bytes(data)
            assert cached(tmp_path, key(), (make := Maker()))["root_pos"][1, 2] == 7 and make.calls == 1
        return
    content = {"half": data[: len(data) // 2], "empty": b"", "no archive": b"x" * 500}
    if cut == "a folder":
        path.unlink()
        path.mkdir()
    elif cut == "another entry's":
        np.savez(path, **entry(3))
    else:
        path.write_bytes(content[cut])
    make = Maker()
    np.testing.assert_array_equal(cached(tmp_path, key(), make)["root_pos"], entry()["root_pos"])
    assert make.calls == 1
    if cut != "a folder":  # which nothing of ours makes, and nothing of ours removes
        cached(tmp_path, key(), make)
        assert make.calls == 1


@pytest.mark.parametrize("values", [np.array([np.nan]), np.array([object()]), np.array(["text"]), np.array([1j])])
def test_what_could_not_be_read_back_is_not_kept(tmp_path, values):
    with pytest.raises(ValueError):
        cached(tmp_path, key(), lambda: {"a": values})
    assert list(tmp_path.iterdir()) == []


def test_a_failure_passes_and_leaves_nothing(tmp_path):
    def fail() -> dict[str, np.ndarray]:
        raise RuntimeError("no solution")

    with pytest.raises(RuntimeError, match="no solution"):
        cached(tmp_path, key(), fail)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_costs_the_entry_and_not_the_result(tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    np.testing.assert_array_equal(cached(tmp_path, key(), Maker())["root_pos"], entry()["root_pos"])
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("bad", ["", "../../escaped", "A" * 64, "0" * 63, "0" * 62 + "/a", "0" * 64 + "\n"])
def test_a_key_of_another_form_names_no_file(tmp_path, bad):
    with pytest.raises(ValueError, match="64 digits"):
        cached(tmp_path / "cache", bad, Maker())
    assert list(tmp_path.iterdir()) == []


def test_beyond_its_size_what_was_used_longest_ago_goes(tmp_path):
    cached(tmp_path, key(0), Maker(0, 5000))
    size = path_of(tmp_path).stat().st_size
    most = int(5.5 * size)
    for number in range(1, 5):
        cached(tmp_path, key(number), Maker(number, 5000), most)
    for number in range(5):
        os.utime(path_of(tmp_path, number), (number, number))
    cached(tmp_path, key(0), Maker(0, 5000), most)  # used again
    cached(tmp_path, key(5), Maker(5, 5000), most)
    there = [number for number in range(6) if path_of(tmp_path, number).exists()]
    assert there == [0, 3, 4, 5]
    assert sum(path.stat().st_size for path in tmp_path.rglob("*.npz")) <= most


def test_equal_arrays_give_equal_bytes(tmp_path):
    for name in ("one", "other"):
        cached(tmp_path / name, key(), Maker())
    assert path_of(tmp_path / "one").read_bytes() == path_of(tmp_path / "other").read_bytes()


def _use(folder: Path, seed: int) -> bool:
    order = np.random.default_rng(seed).permutation(np.tile(np.arange(20), 5))
    right = [
        np.array_equal(cached(folder, key(int(n)), Maker(int(n), 500), 20_000)["root_pos"], entry(n, 500)["root_pos"])
        for n in order
    ]
    return all(right)


def test_two_processes_use_one_cache_while_it_clears(tmp_path):
    context = multiprocessing.get_context("spawn")
    with context.Pool(2) as pool:
        assert pool.starmap(_use, [(tmp_path, 1), (tmp_path, 2)]) == [True, True]
    assert not [path for path in tmp_path.rglob("*") if path.name.endswith(".part")]
    assert cache._read(next(tmp_path.rglob("*.npz"))) is not None
