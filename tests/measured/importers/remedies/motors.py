"""Remedies of maps with motors that turn several joints."""

from tests.measured.importers.remedies.tables import columns, with_columns
from tests.measured.importers.remedies.walk import Case

DIFFERENTIAL = {"hip": {"hip": 0.5, "knee": 0.5}, "knee": {"hip": 0.5, "knee": -0.5}}
CASES = (
    Case(
        "two joints of one motor",
        with_columns(transmission={"hip": {"hip": 1.0, "knee": 1.0}, "knee": {"hip": 2.0, "knee": 2.0}}),
        "no two joints the same factors",
        lambda a, line: a.map["transmission"].update(knee={"hip": 1.0, "knee": -1.0}),
    ),
    Case(
        "a motor's gains",
        with_columns(transmission={"hip": {"hip": 1.0, "knee": 1.0}}, meta={"kp": [40, 40]}),
        "Take kp out of the map",
        lambda a, line: a.map["meta"].pop("kp"),
    ),
    Case(
        "a motor without a command",
        with_columns(transmission=DIFFERENTIAL, columns={"joint_target": ["hip_cmd", "_"]}),
        "in the place of knee",
        columns(joint_target=["hip_cmd", "knee_cmd"]),
    ),
)
