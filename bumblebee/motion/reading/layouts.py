"""The skeletons of a folder's BVH files as a mapping file: what was found, by what evidence, and what is open."""

from dataclasses import dataclass, field

from bumblebee.motion.human.motion import Role
from bumblebee.motion.human.roles import EVIDENCE, NAME
from bumblebee.motion.human.skeleton_file import table_of

_MOST = 8  # skeletons that are printed


@dataclass
class Layouts:
    """Skeletons by their roles, each with the places of the files that have it."""

    files: dict[tuple[Role, ...], list[str]] = field(default_factory=dict)

    def add(self, roles: tuple[Role, ...], place: str) -> None:
        """Note the skeleton of a file; one that a mapping file states is not noted."""
        if roles and all(role.evidence in ("", *EVIDENCE) for role in roles):
            self.files.setdefault(roles, []).append(place)

    def text(self) -> str:
        """A mapping file; "" where all joints of several files were found by name."""
        count = sum(map(len, self.files.values()))
        if count != 1 and all(role.evidence == NAME for roles in self.files for role in roles):
            return ""
        lines = ["# Which joint is which. To change it, save this, correct it, and give it as --skeleton FILE."]
        for roles, places in list(self.files.items())[:_MOST]:
            more = f" and {len(places) - 1:,} more" if len(places) > 1 else ""
            lines += [f"# {places[0]}{more}", table_of(roles)]
        if len(self.files) > _MOST:
            lines.append(f"# ... and {len(self.files) - _MOST:,} more skeletons")
        return "\n".join(lines)
