"""`bumblebee motions inspect` prints which joint is which, and `--skeleton` takes it back, corrected or not."""

import sys

import numpy as np
import pytest
import yaml

from bumblebee import cli
from bumblebee.errors import BadInput
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.reading.folder import ReadConfig, read_folder
from tests.motion.human.layouts import LAYOUTS
from tests.motion.human.rigs import Rig, write
from tests.motion.human.test_skeletons import ANIMAL, PLAIN, swapped, unnamed

FEW = Rig(frames=20)


@pytest.fixture
def run(capsys, monkeypatch):
    def of(*arguments: object) -> tuple[int, str, str]:
        """Exit status and texts of `bumblebee motions ARGUMENTS`."""
        monkeypatch.setattr(sys, "argv", ["bumblebee", "motions", *map(str, arguments)])
        try:
            cli.main()
            status = 0
        except SystemExit as end:
            status = int(end.code or 0)
        said = capsys.readouterr()
        return status, said.out, said.err

    return of


def printed(out: str) -> str:
    """The mapping file within what `inspect` prints."""
    lines = out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("# Which joint is which"))
    return "\n".join(line for line in lines[start:] if line.startswith(("#", "- ", "  ")))


def posed(folder) -> np.ndarray:
    with np.load(next(folder.glob("*.npz"))) as held:
        return np.concatenate([held["root_pos"], held["joint_pos"]], axis=1)


def test_what_inspect_prints_is_a_mapping_file_and_settles_names_left_on_the_right(tmp_path, run):
    (tmp_path / "plain.bvh").write_text(write(LAYOUTS[PLAIN], FEW))
    (tmp_path / "odd.bvh").write_text(write(swapped(LAYOUTS[PLAIN]), FEW))
    status, out, _ = run("inspect", tmp_path / "odd.bvh")
    assert status == 2 and "- pelvis: Hips  # by name" in out and "--skeleton FILE" in out
    turned = {"Left": "Right", "Right": "Left"}
    (table,) = yaml.safe_load(printed(out))
    table = {role: next((joint.replace(a, b) for a, b in turned.items() if a in joint), joint)
             for role, joint in table.items()}  # fmt: skip
    (tmp_path / "my.yaml").write_text(yaml.safe_dump(table))
    status, out, _ = run("inspect", tmp_path / "odd.bvh", "--skeleton", tmp_path / "my.yaml")
    assert status == 0 and "as my.yaml says" in out and "# Which joint" not in out
    for name, more in (("plain", ()), ("odd", ("--skeleton", tmp_path / "my.yaml"))):
        assert run("retarget", tmp_path / f"{name}.bvh", "--out", tmp_path / name, *more)[0] == 0
    np.testing.assert_allclose(posed(tmp_path / "odd"), posed(tmp_path / "plain"), atol=1e-3)


def test_a_joint_that_was_not_found_is_left_open_and_can_be_named(tmp_path, run):
    joints = [(name.replace("Neck", "Nape"), parent.replace("Neck", "Nape"), point)
              for name, parent, point in LAYOUTS[PLAIN] if name != "Head" and parent != "Head"]  # fmt: skip
    (tmp_path / "a.bvh").write_text(write(joints, FEW))
    status, out, err = run("inspect", tmp_path / "a.bvh")
    text = printed(out)
    assert status == 2 and "none for neck" in err and "\n  neck:  # no joint found: name one" in text
    (tmp_path / "my.yaml").write_text(text)
    assert (
        "the name of a joint for neck, came none"
        in run("inspect", tmp_path / "a.bvh", "--skeleton", tmp_path / "my.yaml")[2]
    )
    (tmp_path / "my.yaml").write_text(text.replace("neck:", "neck: Spine2"))
    assert run("inspect", tmp_path / "a.bvh", "--skeleton", tmp_path / "my.yaml")[0] == 0


def test_a_folder_with_several_skeletons_prints_a_list_that_holds_for_all_of_them(tmp_path, run):
    for number, layout in enumerate(("mocopi", "Mixamo", "mocopi")):
        (tmp_path / f"{number}.bvh").write_text(write(LAYOUTS[layout], FEW))
    (tmp_path / "unnamed.bvh").write_text(write(unnamed(LAYOUTS["Rokoko"]), FEW))
    status, out, _ = run("inspect", tmp_path)
    text = printed(out)
    assert status == 0 and len(yaml.safe_load(text)) == 3
    assert "# 0.bvh and 1 more" in text and "- pelvis: root  # by place and length" in text
    (tmp_path / "all.yaml").write_text(text)
    status, again, _ = run("inspect", tmp_path, "--skeleton", tmp_path / "all.yaml")
    assert status == 0 and again.count("skeleton: as all.yaml says") == 4


def test_several_files_whose_joints_all_have_names_print_no_mapping(tmp_path, run):
    for name in "ab":
        (tmp_path / f"{name}.bvh").write_text(write(LAYOUTS[PLAIN], FEW))
    assert "Which joint" not in run("inspect", tmp_path)[1]
    assert "- pelvis: Hips" in run("inspect", tmp_path / "a.bvh")[1]


GOOD = {name: "x" for name in LANDMARKS}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({**GOOD, "left_hipp": "x"}, "expected keys among pelvis, left_hip, "),
        ({**GOOD, "chest": None, "neck": None}, "expected the name of a joint for chest, neck, came none"),
        ({**GOOD, "chest": 7}, "my.yaml: chest: expected the name of a joint, in quotes"),
        (GOOD, "expected a joint 'x' as pelvis, as my.yaml says, came none. Its joints: Hips, "),
        ([GOOD, {"pelvis": "x"}], "my.yaml, skeleton 2: expected the name of a joint for left_hip, "),
        ([], "came an empty list"),
        (None, "came nothing"),
        ("Hips", "came a str"),
    ],
)
def test_a_mapping_that_is_none_is_one_line(tmp_path, run, content, words):
    (tmp_path / "a.bvh").write_text(write(LAYOUTS[PLAIN], FEW))
    (tmp_path / "my.yaml").write_text(yaml.safe_dump(content))
    for command in (("inspect",), ("retarget", "--out", tmp_path / "out")):
        status, _, err = run(*command, tmp_path / "a.bvh", "--skeleton", tmp_path / "my.yaml")
        assert status == 2 and words in err.splitlines()[-1] and not (tmp_path / "out").exists()


def test_the_loop_reads_with_a_mapping_and_refuses_one_that_is_none_before_any_file(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in/a.bvh").write_text(write(swapped(LAYOUTS[PLAIN]), Rig(frames=60)))
    table = {role: joint for role, joint in zip(LANDMARKS, _joints(), strict=True)}
    (tmp_path / "my.yaml").write_text(yaml.safe_dump(table))
    config = ReadConfig(skeleton=str(tmp_path / "my.yaml"))
    reading = read_folder(tmp_path / "in", config, cache=tmp_path / "cache")
    assert len(reading.clips) == 1 and "skeleton: as my.yaml says" in set(reading.notes["note"])
    with pytest.raises(BadInput, match="toes that point backwards"):
        read_folder(tmp_path / "in", ReadConfig(), cache=tmp_path / "cache")
    (tmp_path / "my.yaml").unlink()
    with pytest.raises(BadInput, match=r"my\.yaml: expected a file that says which joint is which, came no such file"):
        read_folder(tmp_path / "in", config)


def _joints() -> list[str]:
    other = {"left": "Right", "right": "Left"}
    limbs = {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toe": "ToeBase", "shoulder": "Arm", "elbow": "ForeArm",
             "wrist": "Hand"}  # fmt: skip
    trunk = {"pelvis": "Hips", "chest": "Spine2", "neck": "Neck", "head": "Head"}
    return [trunk.get(name) or other[name.split("_")[0]] + limbs[name.split("_")[1]] for name in LANDMARKS]


def test_an_animal_is_named_with_what_speaks_against_it(tmp_path, run):
    (tmp_path / "a.bvh").write_text(write(ANIMAL, FEW))
    status, out, _ = run("inspect", tmp_path / "a.bvh")
    assert status == 2 and "left_elbow: LeftForeLeg  # by place and length, against its name" in out
