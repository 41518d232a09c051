"""Which effects: tests, trials, proposals and swaps, one after the other until nothing pays."""

from bumblebee.diagnosis.selection.changes import Loss
from bumblebee.diagnosis.selection.confounding import alike, detectable, rivals
from bumblebee.diagnosis.selection.final_fit import Refined, half_widths, refine, with_other_laws
from bumblebee.diagnosis.selection.forward import Search, search
from bumblebee.diagnosis.selection.leads import Lead, Leads, leads
from bumblebee.diagnosis.selection.proposals.encoder_resolution import entries, grids
from bumblebee.diagnosis.selection.proposals.surface_contact import contact_share
from bumblebee.diagnosis.selection.score_tests import score_tests
from bumblebee.diagnosis.selection.simulation_error import least_simulation_error
from bumblebee.diagnosis.selection.trial import try_one

__all__ = [
    "Lead",
    "Leads",
    "Loss",
    "Refined",
    "Search",
    "alike",
    "contact_share",
    "detectable",
    "entries",
    "grids",
    "half_widths",
    "leads",
    "least_simulation_error",
    "refine",
    "rivals",
    "score_tests",
    "search",
    "try_one",
    "with_other_laws",
]
