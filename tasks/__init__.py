"""What: one module a stage of the loop. Each loads artefacts, calls the library, and saves artefacts."""

import os
import signal

if "DVC_STAGE" in os.environ and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    # While a stage still imports, Ctrl-C ends it without a word; `tasks.stage.run_stage` answers it in one line.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
