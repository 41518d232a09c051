"""A sensor of the base that leans: the windows are whitened anew around its tilt, in which residuals are linear."""

import numpy as np

from bumblebee.diagnosis.residuals import angles, tilt_of
from bumblebee.diagnosis.selection.changes import Anew, Asking
from bumblebee.diagnosis.selection.proposals.all_joints import whitened_anew
from bumblebee.diagnosis.selection.state import SearchState


def whiten_where_it_leans(run: SearchState) -> Asking[None]:
    """Whiten anew around the tilt of the base's sensor, until it stays.

    Residuals are linear in it by the slopes to noise in the starts, and hold about as far as that noise.
    """
    before = np.inf
    while before > (away := _leans_away(run)) > 0:
        before = away
        yield Anew(*whitened_anew(run.problem, run.holdout, run.fit))


def _leans_away(run: SearchState) -> float:
    """Largest angle between the sensor's tilt and that of the whitening [rad]; 0 within the starts' noise."""
    away = float(np.abs(angles(tilt_of(run.fit.effects)) - angles(run.problem.tilt)).max())
    return away if away and away > run.problem.sigma[run.problem.layout.slices["base_rot"]].max() else 0.0
