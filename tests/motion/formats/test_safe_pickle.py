"""Pickles give the arrays that joblib gives, and nothing that they carry is executed."""

import datetime
import io
import os
import pickle
import struct
import zlib

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats import safe_pickle

CONTENT = {
    "plain": {"fps": 30, "name": "walk", "flag": True, "none": None, "ratio": 0.5},
    "arrays": {
        "c": np.arange(12.0).reshape(3, 4),
        "fortran": np.asfortranarray(np.arange(12, dtype=np.float32).reshape(3, 4)),
        "big": np.arange(4, dtype=">f4"),
        "int": np.arange(5),
        "bool": np.array([True, False]),
        "empty": np.zeros((0, 3)),
        "zero_dim": np.array(2.5),
    },
}


def same(came: dict, wanted: dict) -> None:
    assert came.keys() == wanted.keys()
    for key, value in wanted.items():
        if isinstance(value, dict):
            same(came[key], value)
        elif isinstance(value, np.ndarray):
            np.testing.assert_array_equal(came[key], value)
            assert came[key].dtype == value.dtype.newbyteorder("=")
        else:
            assert came[key] == value and type(came[key]) is type(value)


@pytest.mark.parametrize("compress", [0, 3, ("zlib", 9), ("gzip", 3), ("bz2", 3), ("xz", 3), ("lzma", 3)])
def test_joblib_files_come_back(tmp_path, compress):
    joblib.dump(CONTENT, tmp_path / "a.pkl", compress=compress)
    same(safe_pickle.load(tmp_path / "a.pkl"), CONTENT)


@pytest.mark.parametrize("protocol", range(6))
def test_plain_pickles_of_every_protocol_come_back(tmp_path, protocol):
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(CONTENT, protocol=protocol))
    same(safe_pickle.load(tmp_path / "a.pkl"), CONTENT)


def test_numpy_scalars_come_as_numbers(tmp_path):
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"fps": np.int64(30), "dt": np.float32(0.25)}))
    assert safe_pickle.load(tmp_path / "a.pkl") == {"fps": 30, "dt": 0.25}


class Hostile:
    def __init__(self, function, *args):
        self.reduced = function, args

    def __reduce__(self):
        return self.reduced


def hostile_payloads(mark: str) -> dict[str, bytes]:
    made = {
        "os.system": pickle.dumps(Hostile(os.system, f"touch {mark}")),
        "eval": pickle.dumps(Hostile(eval, f"open({mark!r}, 'w')")),
        "inside a motion": pickle.dumps({"walk": {"fps": Hostile(os.system, f"touch {mark}")}}),
        "getattr": pickle.dumps(Hostile(getattr, "x", "upper")),
        "numpy.load": pickle.dumps(Hostile(np.load, mark)),
        "joblib.load": pickle.dumps(Hostile(joblib.load, mark)),
        "a harmless class": pickle.dumps(datetime.date(2020, 1, 1)),
        "protocol 0": pickle.dumps(Hostile(os.system, f"touch {mark}"), protocol=0),
        "INST": f"(S'touch {mark}'\nios\nsystem\n.".encode(),
        "OBJ": b"(cos\nsystem\nS'touch " + mark.encode() + b"'\no.",
        "extension": b"\x80\x02\x82\x01.",
        "persistent id": b"Pabc\n.",
        "dotted name": b"\x80\x04\x8c\x05numpy\x8c\x0fndarray.__new__\x93.",
        "state of a known name": b"\x80\x04\x8c\x05numpy\x8c\x07ndarray\x93N}\x8c\x01x\x8c\x01ys\x86b.",
        "call of a class": b"\x80\x04\x8c\x05numpy\x8c\x07ndarray\x93)R.",
        "call of a number": b"\x80\x04K\x01)R.",
    }
    return made


NAMES = tuple(hostile_payloads("x"))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("packed", [False, True])
def test_hostile_pickles_are_refused_and_execute_nothing(tmp_path, name, packed):
    mark = tmp_path / "executed"
    payload = hostile_payloads(str(mark))[name]
    (tmp_path / "bad.pkl").write_bytes(zlib.compress(payload) if packed else payload)
    with pytest.raises(
        BadInput, match=r"bad\.pkl: expected a pickle of plain values.*Nothing of it was executed"
    ) as caught:
        safe_pickle.load(tmp_path / "bad.pkl")
    assert "\n" not in str(caught.value)
    assert not mark.exists()


def test_the_hostile_pickles_would_have_worked(tmp_path):
    mark = tmp_path / "executed"
    pickle.loads(hostile_payloads(str(mark))["os.system"])
    assert mark.exists()


@pytest.mark.parametrize("dump", [joblib.dump, lambda value, path: path.write_bytes(pickle.dumps(value))])
@pytest.mark.parametrize(
    "array",
    [np.array([{"a": 1}], dtype=object), np.array(["text"]), np.zeros(2, dtype="f4,i4"), np.array(["2020"], "M8")],
)
def test_arrays_that_are_not_numeric_are_refused(tmp_path, dump, array):
    dump({"a": array}, tmp_path / "a.pkl")
    with pytest.raises(BadInput):
        safe_pickle.load(tmp_path / "a.pkl")


def test_an_object_array_cannot_carry_code_in(tmp_path):
    mark = tmp_path / "executed"
    joblib.dump({"a": np.array([Hostile(os.system, f"touch {mark}")], dtype=object)}, tmp_path / "a.pkl")
    with pytest.raises(BadInput, match="not numeric"):
        safe_pickle.load(tmp_path / "a.pkl")
    assert not mark.exists()


@pytest.mark.parametrize("compress", [0, 3, ("bz2", 3)])
def test_a_pickle_cut_anywhere_is_truncated_and_never_read_in_part(tmp_path, compress):
    joblib.dump(CONTENT, tmp_path / "whole.pkl", compress=compress)
    whole = (tmp_path / "whole.pkl").read_bytes()
    for end in range(0, len(whole) - 1, max(1, len(whole) // 60)):
        (tmp_path / "cut.pkl").write_bytes(whole[:end])
        with pytest.raises(BadInput, match=r"cut\.pkl") as caught:
            safe_pickle.load(tmp_path / "cut.pkl")
        assert "\n" not in str(caught.value)


def test_rubbish_is_bad_input(tmp_path):
    rng = np.random.default_rng(0)
    joblib.dump(CONTENT, tmp_path / "whole.pkl")
    whole = np.frombuffer((tmp_path / "whole.pkl").read_bytes(), np.uint8)
    for _ in range(300):
        broken = whole.copy()
        broken[rng.integers(len(whole), size=3)] = rng.integers(256, size=3)
        (tmp_path / "broken.pkl").write_bytes(broken.tobytes())
        try:
            safe_pickle.load(tmp_path / "broken.pkl")  # a flipped bit in a number is a number
        except BadInput:
            continue


@pytest.mark.parametrize("fact", [{"shape": (10**12,)}, {"shape": (-1,)}, {"shape": "x"}, {"shape": (2**62, 4)}])
def test_impossible_sizes_are_refused_before_memory_is_taken(tmp_path, fact):
    wrapper = {"shape": (2,), "dtype": np.dtype("f8"), "order": "C", "numpy_array_alignment_bytes": 16, **fact}
    stream = io.BytesIO()
    pickler = pickle.Pickler(stream, protocol=4)
    pickler.dump(wrapper)
    body = stream.getvalue()[:-1]  # without STOP
    name = b"\x8c\x13joblib.numpy_pickle\x8c\x11NumpyArrayWrapper\x93)\x81"
    (tmp_path / "a.pkl").write_bytes(b"\x80\x04" + name + body[2 + 9 :] + b"b.")
    with pytest.raises(BadInput):
        safe_pickle.load(tmp_path / "a.pkl")


def test_a_byte_array_longer_than_the_file_takes_no_memory(tmp_path):
    (tmp_path / "a.pkl").write_bytes(b"\x80\x05\x96" + struct.pack("<Q", 1 << 40) + b"x.")
    with pytest.raises(BadInput, match="longer than the file"):
        safe_pickle.load(tmp_path / "a.pkl")


def test_a_decompression_bomb_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(safe_pickle, "MAX_BYTES", 10_000)
    (tmp_path / "a.pkl").write_bytes(zlib.compress(bytes(1_000_000)))
    with pytest.raises(BadInput, match="unpacks to more"):
        safe_pickle.load(tmp_path / "a.pkl")


def test_a_number_that_is_none_is_not_quoted_at_length(tmp_path):
    (tmp_path / "a.pkl").write_bytes(b"F" + b"x" * 100_000 + b"\n.")
    with pytest.raises(BadInput, match="a broken one") as caught:
        safe_pickle.load(tmp_path / "a.pkl")
    assert len(str(caught.value)) < 600
