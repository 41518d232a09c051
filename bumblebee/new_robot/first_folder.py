"""Writes a robot's first folder: the maker's MJCF as it is, a robot.yaml that is a draft, a picture from four sides."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bumblebee import quaternions
from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.io.write import new_folder, refuse_foreign, refuse_overlap
from bumblebee.new_robot.draft import draft, ends_of, poses_of
from bumblebee.new_robot.maker import maker_of
from bumblebee.robot.mjcf import bodies_of
from bumblebee.robot.shapes import Bodies
from bumblebee.robot.which import FILE

_NAME = 60
_PIXELS = 260  # a metre of the picture
_VIEWS = (("front", 1, 1), ("left", 0, -1), ("back", 1, -1), ("right", 0, 1))


def draft_folder(model: Path, out: Path, overwrite: bool = False) -> tuple[str, ...]:
    """Write the folder; what a person must tell or look at.

    Raises:
        BadInput: a model that is no humanoid's (`mjcf.bodies_of`, `draft.draft`), or a folder that is there.
    """
    if out.exists() and not overwrite:
        raise BadInput(out, "a new folder", "one that is there", "Name another, or say --overwrite.")
    refuse_foreign(out, lambda path: (path / FILE).is_file(), "a robot's folder")
    refuse_overlap(out, [model])
    bodies = bodies_of(model)
    made = draft(model, model.stem[:_NAME], model.name, bodies, maker_of(model))
    text = "# A draft: `bumblebee robot check` says what does not hold; docs/your-robot.md explains each key.\n"
    with new_folder(out) as folder:
        (folder / model.name).write_bytes(read_bytes(model))
        (folder / FILE).write_text(
            text + yaml.dump(made.said, Dumper=_Short, sort_keys=False, width=120), encoding="utf-8"
        )
        (folder / "robot.svg").write_text(picture(bodies, made.said), encoding="utf-8")
    return made.asked


class _Short(yaml.SafeDumper):
    """Plain YAML in which lists of numbers, and tables of them, stand on a line."""

    def ignore_aliases(self, data: Any) -> bool:
        """Equal lists are written twice, which a person changes more easily."""
        return True

    def represent_sequence(self, tag: str, sequence: Any, flow_style: bool | None = None) -> yaml.SequenceNode:
        """A list on one line."""
        return super().represent_sequence(tag, sequence, flow_style=True)


def picture(bodies: Bodies, said: dict[str, Any]) -> str:
    """The robot's shapes in its stand from four sides as SVG, with the key bodies' roles and the soles."""
    at = poses_of(bodies, said["stand"])
    ends = {
        name: [np.array(e) for s in facts.get("collision", []) for e in ends_of(s)] for name, facts in bodies.items()
    }
    points = np.array([at[n][0] + _turn(at, n, e) for n, own in ends.items() for e in own] or [np.zeros(3)])
    low, high = points.min(axis=0) - 0.15, points.max(axis=0) + 0.15
    wide, tall = float(max(high[:2] - low[:2])), float(high[2] - low[2])
    parts = []
    for number, (title, axis, sign) in enumerate(_VIEWS):
        left = (number + 0.5) * wide - sign * float(low[axis] + high[axis]) / 2

        def place(point: np.ndarray, axis: int = axis, sign: int = sign, left: float = left) -> tuple[float, float]:
            return _PIXELS * (left + sign * float(point[axis])), _PIXELS * float(high[2] - point[2])

        parts.append(f'<text x="{_PIXELS * (number + 0.5) * wide:.0f}" y="16" class="title">{title}</text>')
        for name, facts in bodies.items():
            for shape in facts.get("collision", []):
                (x1, y1), (x2, y2) = (place(at[name][0] + _turn(at, name, e)) for e in _two(ends_of(shape)))
                size = 2 * _PIXELS * shape["size"][0]
                parts.append(f'<path d="M{x1:.1f} {y1:.1f}L{x2 + 0.1:.1f} {y2:.1f}" stroke-width="{size:.1f}"/>')
        parts += _marks(at, said, place, number)
    size = f"{4 * wide * _PIXELS:.0f} {tall * _PIXELS + 20:.0f}"
    style = (
        "path{stroke:#f3c433;stroke-linecap:round;stroke-opacity:.55}circle{fill:#1a5fb4}.sole{fill:#c01c28}"
        "text{font:9px sans-serif;fill:#1a1a1a}.title{font:bold 13px sans-serif;text-anchor:middle}"
    )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}"><style>{style}</style>'
    return "".join([head, '<rect width="100%" height="100%" fill="#fff"/>', *parts, "</svg>"])


def _marks(at: Any, said: dict[str, Any], place: Any, view: int) -> list[str]:
    """Key bodies with their roles, of the sides only those that are nearer, and the soles' corners."""
    hidden = {1: "right_", 3: "left_"}.get(view, "none")
    found = []
    for role, value in said["key_bodies"].items():
        if role.startswith(hidden):
            continue
        body, local = (value, [0, 0, 0]) if isinstance(value, str) else value
        x, y = place(at[body][0] + _turn(at, body, np.array(local, float)))
        found.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5"/><text x="{x + 4:.1f}" y="{y - 3:.1f}">{role}</text>')
    for side, corners in said["soles"].items():
        foot = said["key_bodies"][f"{side}_foot"]
        for corner in corners:
            x, y = place(at[foot][0] + _turn(at, foot, np.array(corner)))
            found.append(f'<circle class="sole" cx="{x:.1f}" cy="{y:.1f}" r="2"/>')
    return found


def _two(ends: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return ends[0], ends[-1]


def _turn(at: Any, body: str, local: np.ndarray) -> np.ndarray:
    return quaternions.rotate(at[body][1], local)
