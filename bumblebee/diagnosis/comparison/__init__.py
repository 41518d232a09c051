"""Whether one model is better than another: held-out windows, standard errors, the number of parameters."""

from bumblebee.diagnosis.comparison.artefacts import is_physical
from bumblebee.diagnosis.comparison.backward_elimination import (
    certainty,
    drop_beside,
    drop_insignificant,
    drop_redundant,
    drop_unpaid,
    drop_unpaid_saturations,
    drop_unsure,
)
from bumblebee.diagnosis.comparison.compare import compare, lead
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.information_criterion import criterion, numbers_of, parameters
from bumblebee.diagnosis.comparison.paired_tests import confirmed, plausible
from bumblebee.diagnosis.comparison.submodel import (
    columns_without,
    linear_cost,
    linearly_without,
    refitted,
    refitted_without,
    simulated_without,
)
from bumblebee.diagnosis.comparison.wald import Step, costs_more_than, evidence, wald, walds, z_value, z_values
from bumblebee.diagnosis.comparison.withdrawal import standing, withdrawn

__all__ = [
    "Holdout",
    "Step",
    "certainty",
    "columns_without",
    "compare",
    "confirmed",
    "costs_more_than",
    "criterion",
    "drop_beside",
    "drop_insignificant",
    "drop_redundant",
    "drop_unpaid",
    "drop_unpaid_saturations",
    "drop_unsure",
    "evidence",
    "is_physical",
    "lead",
    "linear_cost",
    "linearly_without",
    "numbers_of",
    "parameters",
    "plausible",
    "refitted",
    "refitted_without",
    "simulated_without",
    "standing",
    "wald",
    "walds",
    "withdrawn",
    "z_value",
    "z_values",
]
