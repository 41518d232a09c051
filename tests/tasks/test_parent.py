"""A stage ends when what started it was killed, also where a shell stands between."""

import subprocess
import sys

import psutil
import pytest

CHILD = (
    "from tasks.parent import end_with_parent; end_with_parent(); print('up', flush=True); import time; time.sleep(60)"
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
