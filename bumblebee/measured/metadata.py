"""The metadata of a rollout file: one JSON object under the Parquet key `bumblebee.rollout`, schema 1."""

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.names import require_stem
from bumblebee.io.read import decode, parse_json
from bumblebee.measured.conditions import check_conditions

METADATA_KEY = b"bumblebee.rollout"
SCHEMA = 1
LONGEST_ID = 200  # bytes: a motion's name with round and cluster before it; file systems take 255 with the ending
LARGEST = 1e9  # of a rate or gain
REQUIRED_KEYS = ("schema", "rollout_id", "joints", "control_hz")
OPTIONAL_KEYS = (
    *("robot", "kp", "kd", "motion", "cluster", "policy", "recorded_at", "operator", "notes"),
    "compensation",  # sha256 of what was undone at the joints meanwhile
    "conditions",  # what was different meanwhile, see `measured.conditions`
)


@dataclass(frozen=True)
class Metadata:
    """Metadata of a rollout file."""

    rollout_id: str
    joints: tuple[str, ...]
    control_hz: float
    rest: dict[str, Any]


def encode_metadata(meta: Metadata) -> bytes:
    """The JSON object of the contract; keys that are None are left out."""
    table = {"schema": SCHEMA, "rollout_id": meta.rollout_id}
    table |= {"joints": list(meta.joints), "control_hz": meta.control_hz}
    rest = {key: value for key, value in meta.rest.items() if value is not None and key not in table}
    return json.dumps(table | rest, default=_plain, ensure_ascii=False).encode("utf-8", "replace")


def decode_metadata(path: Path, raw: bytes | None, bad: Callable[..., Exception]) -> Metadata:
    """Parse and check the metadata; `bad(file, column, rule, expected, came, do)` makes the error that is raised."""
    column = METADATA_KEY.decode()
    if raw is None:
        raise bad(path, column, "metadata", f"JSON under the Parquet metadata key {column}", "no such key")
    try:
        table = parse_json(column, decode(column, raw))
        json.dumps(table, ensure_ascii=False).encode()
    except BadInput as error:
        raise bad(path, column, "metadata", error.expected, error.came) from None
    except UnicodeEncodeError:
        raise bad(path, column, "metadata", "text that UTF-8 can hold", "half of a surrogate pair") from None
    if not isinstance(table, dict):
        raise bad(path, column, "metadata", "a JSON object", type(table).__name__)
    for key in REQUIRED_KEYS:
        if key not in table:
            raise bad(path, column, "metadata", f"the key {key}", f"only {', '.join(sorted(table))}"[:200])
    if table["schema"] != SCHEMA:
        raise bad(path, column, "schema", f"schema {SCHEMA}", repr(table["schema"])[:80])
    _check_fields(path, table, lambda rule, expected, came: bad(path, column, rule, expected, came))
    rest = {key: value for key, value in table.items() if key not in REQUIRED_KEYS and value is not None}
    return Metadata(table["rollout_id"], tuple(table["joints"]), float(table["control_hz"]), rest)


def _check_fields(path: Path, table: dict[str, Any], bad: Callable[[str, str, str], Exception]) -> None:
    joints, rate, name = table["joints"], table["control_hz"], table["rollout_id"]
    try:
        require_stem(path, name, LONGEST_ID)
    except BadInput as error:
        raise bad("rollout-id", error.expected, error.came) from None
    if name != path.stem:
        raise bad("rollout-id", f"the name of the file, {path.stem}", repr(name))
    if not isinstance(joints, list) or not joints or not all(map(_is_name, joints)):
        raise bad("metadata", "joints: a list of names", repr(joints)[:80])
    if len(set(joints)) != len(joints):
        raise bad("joint-names", "every joint once", f"{Counter(joints).most_common(1)[0][0]} twice")
    if not _is_number(rate) or not 0 < rate < 1e5:
        raise bad("metadata", "control_hz: a positive number", repr(rate)[:80])
    for key in ("kp", "kd"):
        values = table.get(key)
        if values is not None and not (
            isinstance(values, list) and len(values) == len(joints) and all(_is_number(value) for value in values)
        ):
            raise bad("metadata", f"{key}: {len(joints)} numbers", repr(values)[:80])
    if table.get("conditions") is not None:
        check_conditions(table["conditions"], lambda name, expected, came: bad(name, expected, came))


def _is_name(value: object) -> bool:
    # A NUL would end the name for MuJoCo and not for us.
    return isinstance(value, str) and value.strip() != "" and all(ord(sign) >= 32 for sign in value)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
