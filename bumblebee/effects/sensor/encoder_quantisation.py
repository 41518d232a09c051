"""An encoder of few steps."""

from typing import Any

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import IN_THE_READINGS


class EncoderQuantisation(Kind):
    """The reading is rounded to multiples of `step`. The search has no candidate: it is read off the log's values."""

    rank = 290
    parameters = (Parameter("step", "rad", 0.0, 0.2),)
    native, absent = False, 0.0
    experiment = "log at rest"
    fine_steps = True
    law = IN_THE_READINGS
    not_undone = "what the encoder rounds away is not known"

    def hook(self, making: Any, effect: Given) -> None:
        making.first("encoder_step", effect)
