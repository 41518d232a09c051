"""Small diagnoses of the arm, each made once."""

import pytest

from bumblebee.diagnosis.diagnose import Diagnosis, diagnose
from bumblebee.diagnosis.simulation import simulate as simulating
from tests.diagnosis.arm import SMALL, session_of, simulate

simulating.THREADS = 1  # tests run side by side
_made: dict[tuple, Diagnosis] = {}


@pytest.fixture(scope="session")
def diagnosed():
    """A function: effects of the truth and a seed -> Diagnosis."""

    def make(
        effects: dict[tuple[str, str], float], seed: int = 0, count: int = 3, still: int | None = None
    ) -> Diagnosis:
        key = (tuple(effects.items()), seed, count, still)
        if key not in _made:
            rollouts = simulate(effects, count=count, seed=seed, still=still)
            _made[key] = diagnose(session_of(rollouts), SMALL)
        return _made[key]

    return make
