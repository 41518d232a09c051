"""Chosen effects fitted together, and how sure their values are."""

from bumblebee.diagnosis.estimation.covariance import expected_covariance, interval, standard_covariance
from bumblebee.diagnosis.estimation.fit import Fit, typical_power
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton, resolved
from bumblebee.diagnosis.estimation.integrator_error import beyond_numerics, explained_share, moves
from bumblebee.diagnosis.estimation.least_squares import LeftOver, cost_of, project, solve
from bumblebee.diagnosis.estimation.levenberg_marquardt import levenberg_marquardt
from bumblebee.diagnosis.estimation.response_surface import last_step

__all__ = [
    "Fit",
    "LeftOver",
    "beyond_numerics",
    "cost_of",
    "expected_covariance",
    "explained_share",
    "gauss_newton",
    "interval",
    "last_step",
    "levenberg_marquardt",
    "moves",
    "project",
    "resolved",
    "solve",
    "standard_covariance",
    "typical_power",
]
