"""Stages of the loop, one module each: it loads artefacts, calls the library, and saves artefacts."""

import os
import signal

from bumblebee.robot.which import FILE, VARIABLE
from tasks.running.paths import ROBOT

if (ROBOT / FILE).is_file() and ("DVC_STAGE" in os.environ or VARIABLE not in os.environ):
    # Before anything is imported that is made for a robot: the workspace says which, to its stages and their processes.
    os.environ[VARIABLE] = str(ROBOT.resolve())

if "DVC_STAGE" in os.environ:
    # Before the stage's imports, which take seconds: a loop that is killed meanwhile must not leave it behind.
    from tasks.running.parent import end_with_parent

    end_with_parent()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # While it imports, Ctrl-C ends it without a word; `tasks.running.stage.run_stage` answers it in one line.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
