"""What no effect of the catalogue explains: whether it is there, on which joint, and in what form."""

from bumblebee.diagnosis.discrepancy.catalogue_alternative import offers_of, with_named
from bumblebee.diagnosis.discrepancy.catalogue_terms import quantities_of
from bumblebee.diagnosis.discrepancy.discover import Discovery, discover
from bumblebee.diagnosis.discrepancy.residual_tests import JointRemains, remains
from bumblebee.diagnosis.discrepancy.term_library import Law

__all__ = [
    "Discovery",
    "JointRemains",
    "Law",
    "discover",
    "offers_of",
    "quantities_of",
    "remains",
    "with_named",
]
