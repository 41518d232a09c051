#!/bin/bash
# mcap-ros2-support 0.6.0. The writer takes a message as a dictionary and ignores keys that the definition does not have:
# a misspelt field is written as 0 without a word. Seen: position 0.0 where 1.5 was given as "positon".
# Source: mcap_ros2.writer.Writer.write_message.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mcap-ros2-support==0.6.0 mcap==1.6.0
cd "$here"
venv/bin/python - <<'PY'
import io
from importlib.metadata import version

from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer

file = io.BytesIO()
writer = Writer(file)
schema = writer.register_msgdef("demo/msg/Joint", "float64 position\nfloat64[] effort\n")
writer.write_message("/j", schema, {"positon": 1.5, "effort": [2.0]}, log_time=1, publish_time=1, sequence=0)
writer.finish()
file.seek(0)
(message,) = read_ros2_messages(file)
print("mcap-ros2-support", version("mcap-ros2-support"), "position", message.ros_msg.position)
assert message.ros_msg.position == 0.0 and list(message.ros_msg.effort) == [2.0]
PY
