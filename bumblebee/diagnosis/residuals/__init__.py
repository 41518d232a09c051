"""How far measured and simulated windows are apart, whitened, and what is no fault of the model."""

from bumblebee.diagnosis.residuals.empirical_covariance import by_misfit
from bumblebee.diagnosis.residuals.imu_tilt import angles, tilt_of
from bumblebee.diagnosis.residuals.nuisances import NAMES, nuisance_columns
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, screening_windows, window_weights
from bumblebee.diagnosis.residuals.whitening import NoisyWindows, Whitener, fit_whitener, null_draws

__all__ = [
    "NAMES",
    "NoisyWindows",
    "Problem",
    "Whitener",
    "angles",
    "by_misfit",
    "fit_whitener",
    "make_problem",
    "nuisance_columns",
    "null_draws",
    "screening_windows",
    "tilt_of",
    "window_weights",
]
