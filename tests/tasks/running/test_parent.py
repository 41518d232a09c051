"""A stage ends when what started it was killed, also where a shell stands between."""

import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

CHILD = (
    "from tasks.running.parent import end_with_parent; end_with_parent(); print('up', flush=True); "
    "import time; time.sleep(60)"
)
STARTER = """
import subprocess, sys
child = subprocess.Popen({command!r}, stdout=subprocess.PIPE, text=True)
child.stdout.readline()
import psutil
print(psutil.Process(child.pid).children(recursive=True)[-1].pid if {shell} else child.pid, flush=True)
child.wait()
"""


@pytest.mark.parametrize("shell", [False, True])
def test_it_ends_with_the_process_that_started_it(shell: bool):
    direct = [sys.executable, "-c", CHILD]
    quoted = f'{sys.executable} -c "{CHILD}"; true'  # with a second command no shell replaces itself
    code = STARTER.format(command=["/bin/sh", "-c", quoted] if shell else direct, shell=shell)
    starter = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert starter.stdout is not None
    child = psutil.Process(int(starter.stdout.readline()))
    starter.kill()
    starter.wait()
    _, alive = psutil.wait_procs([child], timeout=20)
    assert all(process.status() == psutil.STATUS_ZOMBIE for process in alive)


LATE = """
import os, sys, time
os.environ["DVC_STAGE"] = "stage"
time.sleep(0.2)  # no word is said before the pipe is gone, and none can be said after
import tasks
print(os.getpid(), file=open({place!r}, "w"), flush=True)
time.sleep(60)
"""


def test_a_stage_ends_while_it_still_imports_and_where_nobody_reads_its_last_word(tmp_path: Path):
    place, code = tmp_path / "pid", tmp_path / "stage.py"
    code.write_text(LATE.format(place=str(place)))
    quoted = f"PYTHONPATH={Path.cwd()} {sys.executable} {code}; true"
    start = f"import subprocess; p = subprocess.Popen(['/bin/sh', '-c', {quoted!r}], stdout=-1, stderr=-2); p.wait()"
    starter = subprocess.Popen([sys.executable, "-c", start])
    end = time.monotonic() + 60
    while not (place.exists() and place.read_text().strip()) and time.monotonic() < end:
        time.sleep(0.05)
    child = psutil.Process(int(place.read_text()))
    starter.kill()
    starter.wait()
    _, alive = psutil.wait_procs([child], timeout=20)
    assert all(process.status() == psutil.STATUS_ZOMBIE for process in alive)
