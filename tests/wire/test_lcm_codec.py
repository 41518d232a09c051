"""Messages: the bytes that lcm-gen's code writes and reads, and what is no message."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import bumblebee.wire.links
from bumblebee.errors import BadInput
from bumblebee.wire.links.lcm_codec import Codec, decode_card, encode_card
from tests.wire.made import card, order, state

GEN = shutil.which("lcm-gen", path=str(Path(sys.executable).parent))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """Modules that lcm-gen makes of our file."""
    if GEN is None:
        pytest.skip("no lcm-gen here: it comes with the package lcm")
    folder = tmp_path_factory.mktemp("lcm")
    file = Path(bumblebee.wire.links.__file__).with_name("bumblebee_wire.lcm")
    subprocess.run([GEN, "-p", "--ppath", str(folder), str(file)], check=True)
    modules = {}
    for name in ("state_t", "order_t", "card_t"):
        spec = importlib.util.spec_from_file_location(name, folder / "bumblebee_wire" / f"{name}.py")
        assert spec is not None and spec.loader is not None
        modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(modules[name])
    return modules


@pytest.mark.parametrize("kind", ["state", "order", "card"])
def test_the_bytes_are_those_of_the_generated_code(kind: str, made: dict[str, ModuleType]) -> None:
    value, codec = {"state": state, "order": order, "card": card}[kind](), Codec(3)
    ours = encode_card(value) if kind == "card" else getattr(codec, f"encode_{kind}")(value)
    theirs = getattr(made[f"{kind}_t"], f"{kind}_t")
    read = theirs.decode(ours)
    assert read.encode() == ours and read.num_joints == 3
    for name in vars(value):
        np.testing.assert_array_equal(getattr(read, name), getattr(value, name))


def test_a_message_comes_back_as_it_was() -> None:
    codec = Codec(3)
    pairs = [(state(), codec.state(codec.encode_state(state()))), (order(), codec.order(codec.encode_order(order())))]
    for one, other in [*pairs, (card(), decode_card(encode_card(card())))]:
        for name, value in vars(one).items():
            np.testing.assert_array_equal(getattr(other, name), value)


def test_what_is_no_message_is_one_line() -> None:
    codec, good = Codec(3), Codec(3).encode_state(state())
    other_version = good[:8] + b"\0\0\0\2" + good[12:]
    for bad, word in (
        (good[:40], "bytes"),
        (b"", "bytes"),
        (b"\0" * len(good), "another type"),
        (other_version, "version"),
        (Codec(3).encode_order(order()), "another type"),
    ):
        with pytest.raises(BadInput, match=word):
            codec.state(bad)
    with pytest.raises(BadInput, match="num_joints"):
        Codec(4).state(good)
    with pytest.raises(BadInput, match="mode"):
        codec.order(codec.encode_order(order(mode=7)))
    for cut in range(0, len(encode_card(card())), 3):
        with pytest.raises(BadInput):
            decode_card(encode_card(card())[:cut])
