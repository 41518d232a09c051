"""A law that has no name, a sum of terms that the diagnosis has found."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import CannotUndo, Given, Kind
from bumblebee.effects.mjcf import stick, stick_in_place
from bumblebee.effects.places import Spot
from bumblebee.effects.terms import read_term
from bumblebee.effects.words import fed_along


class Discovered(Kind):
    """Coefficients by terms of `effects.terms`; its parameters are none of the catalogue's."""

    rank = 380
    native = False
    law = "it is made of terms"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        stick(spec, place)

    def write(self, spot: Spot, *values: float) -> None:
        stick_in_place(spot)

    def declared(self, spot: Spot) -> Sequence[float] | np.ndarray:
        return ()

    def hook(self, making: Any, effect: Given) -> None:
        making.terms(effect)

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        for text, coefficient in effect.parameters.items():
            term = read_term(text)
            if term.states:
                raise CannotUndo(f"it remembers ({term.states[0][0]}), and nobody reads what")
            if "tau" in term.names or "tau[" in text:
                raise CannotUndo("it depends on the drive's torque at the same instant")
            if "t" in term.names:
                raise CannotUndo("it depends on how long the robot has run since it was measured")
            draft.terms += [(int(column), float(coefficient), term.text) for column in columns]
        rubs = all(read_term(text).rubs for text in effect.parameters)
        how = (
            fed_along(draft) if rubs else "its value at the measured angle and the intended velocity is sent against it"
        )
        return how, " ".join(f"{value:+.3g} {text[:40]}" for text, value in effect.parameters.items())[:120]
