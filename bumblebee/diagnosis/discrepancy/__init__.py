"""Model discrepancy beyond the catalogue: whether it is there, on which joint, and with which discrepancy model."""

from bumblebee.diagnosis.discrepancy.catalogue_alternative import offers_of, with_catalogue_effects
from bumblebee.diagnosis.discrepancy.catalogue_terms import quantities_of
from bumblebee.diagnosis.discrepancy.discover import Discovery, discover
from bumblebee.diagnosis.discrepancy.residual_tests import JointActivity, JointLackOfFit, LackOfFit, lack_of_fit
from bumblebee.diagnosis.discrepancy.term_library import BasisFunction

__all__ = [
    "BasisFunction",
    "Discovery",
    "JointActivity",
    "JointLackOfFit",
    "LackOfFit",
    "discover",
    "lack_of_fit",
    "offers_of",
    "quantities_of",
    "with_catalogue_effects",
]
