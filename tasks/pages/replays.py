"""3D replays of the report: motions with the robot's last run of each, and measured windows beside simulated ones."""

from collections.abc import Iterator

from bumblebee.diagnosis.dataset import open_session
from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.motion.clip import Clip, clip_states
from bumblebee.motion.store import read_library
from bumblebee.report.films.filmstrip import states
from bumblebee.report.replays.replay import GHOST, Drawn, Part, Take, part, side_by_side
from bumblebee.report.replays.replay_page import player
from bumblebee.report.replays.shape import Shape, shape
from bumblebee.report.replays.windows import window_takes
from bumblebee.report.results import LoopResults
from bumblebee.robot.model import build_spec
from bumblebee.sim.effects import read_effects
from tasks.running import paths

MOTIONS = "motions"
"""Group of the motions' replays; a round's windows have `windows-rN`."""


def replays(results: LoopResults) -> tuple[Part, dict[str, str]]:
    """All replays of the page, and the player of each group."""
    takes = [*(take for turn in results.rounds for take in _windows(turn.n)), *_motions(results)]
    made = part(takes)
    first = {take.group: take for take in reversed(takes) if (take.group, take.name) in made.names}
    words = {
        MOTIONS: ("Motion in 3D", "Grey: the robot's last measured run of it, or the motion alone; blue: the motion.")
    }
    other = ("Measured and simulated, in 3D", "From the measured state, with the same commands, on held-out rollouts.")
    told = {group: words.get(group, other) for group in first}
    return made, {g: player(first[g], title, f"{said} {made.note}".strip()) for g, (title, said) in told.items()}


def _windows(n: int) -> list[Take]:
    measured = paths.measured(n)
    session = open_session(measured / "model.xml", measured)
    return window_takes(session, read_effects(paths.diagnosis(n) / "effects.yaml"), f"windows-r{n}")


def _motions(results: LoopResults) -> Iterator[Take]:
    """Motions of the map, those that the robot ran last first."""
    points, drawn = results.points, shape(build_spec())
    if points is None:
        return
    ran: dict[str, Rollout] = {}
    for turn in results.rounds if not results.real_robot else ():
        for path in sorted((paths.measured(turn.n) / "rollouts").glob("*.parquet")):
            rollout = read_rollout(path)
            ran[str(rollout.meta.get("motion"))] = rollout
    names = sorted(points.loc[points["poses"] != "", "name"], key=lambda name: name not in ran)
    for clip in read_library(paths.FILTERED, names):
        yield _motion(clip, ran.get(clip.name), drawn)


def _motion(clip: Clip, rollout: Rollout | None, drawn: Shape) -> Take:
    wanted = clip_states(clip)
    name = " ".join(clip.name.split())  # as the map has it
    if rollout is None or rollout.base_pos is None or rollout.control_hz != clip.fps:
        return Take(name, MOTIONS, wanted, clip.fps, (Drawn("motion"),), drawn)
    robots = (Drawn("robot"), Drawn("motion", GHOST))
    note = f"Measured rollout {rollout.rollout_id}."
    return Take(name, MOTIONS, side_by_side([states(rollout), wanted]), clip.fps, robots, drawn, note)
