"""The log of the loop: a stage's failure is said once, in its own words."""

import logging

from flows import loop  # noqa: F401  (it sets the filter)


def record(text: str) -> logging.LogRecord:
    return logging.LogRecord("prefect.task_runs", logging.ERROR, "", 0, text, None, None)


def test_prefects_echo_of_a_failed_stage_is_left_out_and_all_else_is_kept():
    logger = logging.getLogger("prefect.task_runs")
    assert not logger.filter(record("Task run failed with state: Failed(message='base: no')"))
    assert logger.filter(record("Finished in state Failed('base: no')"))
    assert logger.filter(record("base: no such file"))
