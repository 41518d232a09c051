#!/bin/bash
# mcap 1.6.0. Of a recording without its end (the recorder was killed), `iter_messages()` raises before it gives the first
# message, although all are there: messages are sorted by log time, which needs the whole file. `log_time_order=False` gives
# them all, and raises then. Seen: 0 of 100 messages by default, 100 of 100 unsorted. Source: mcap.reader.NonSeekingReader.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mcap==1.6.0
cd "$here"
venv/bin/python - <<'PY'
import io
from importlib.metadata import version

from mcap.reader import NonSeekingReader
from mcap.writer import Writer

file = io.BytesIO()
writer = Writer(file, chunk_size=2000)
writer.start()
channel = writer.register_channel("t", "json", writer.register_schema("s", "jsonschema", b"{}"))
for stamp in range(100):
    writer.add_message(channel, log_time=stamp, data=b"x" * 1000, publish_time=stamp)
written = file.getvalue()  # no finish(): what a killed recorder leaves
came = {}
for ordered in (True, False):
    came[ordered] = 0
    try:
        for _ in NonSeekingReader(io.BytesIO(written)).iter_messages(log_time_order=ordered):
            came[ordered] += 1
    except Exception as error:
        print("log_time_order", ordered, "ends with", type(error).__name__)
print("mcap", version("mcap"), "messages by log_time_order", came)
assert came == {True: 0, False: 100}
PY
