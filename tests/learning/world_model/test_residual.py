"""A residual on a world model: it starts at nothing, learns what the simulator lacks, and is kept only by evidence."""

from copy import deepcopy
from dataclasses import replace

import pytest
import torch
from torch import nn

from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.measured import Measured, measured
from bumblebee.learning.world_model.memory import Memory
from bumblebee.learning.world_model.residual import (
    Fitted,
    ResidualConfig,
    corrected,
    fit_residual,
    new_residual,
    predicted_error,
)
from bumblebee.sim.sensors import load_model
from tests.learning.swaying import ANKLES, record, weakened

DT, JOINTS = 0.02, 23
CONFIG = ResidualConfig(hidden=(32,), window=8, batch=48, updates=80, rate=3e-3, check_every=20)


class Lab:
    """A model of the swaying robot, its simulated steps, and recordings of a robot."""

    def __init__(self, share: float) -> None:
        self.model = load_model()
        declared = self.recorded(1.0, seed=5)
        self.simulated = Memory(38, torch.zeros(8, 0), JOINTS)
        rows = declared.recordings
        for step in range(1, 39):
            at = rows.start + step
            shown = dict.fromkeys(("action", "earlier"), torch.zeros(8, JOINTS))
            targets = {"target": rows.targets[at], "before": rows.targets[at - 1]}
            self.simulated.begin(
                torch.zeros(8).long(), torch.zeros(8).long(), body=declared.bodies[at], **targets, **shown
            )
            self.simulated.end(torch.zeros(8, dtype=torch.bool))
        torch.manual_seed(0)
        self.dynamics = Dynamics(JOINTS, (32,), DT)
        window = declared.windows(declared.first_rows(4, stride=3), 4)
        self.dynamics.normalise(window.bodies[0], window.targets[0], window.before, window.context, window.bodies[1])
        adam = torch.optim.Adam(self.dynamics.parameters(), 3e-3)
        for _ in range(100):
            adam.zero_grad()
            predicted = self.dynamics.unrolled(window.bodies[0], window.targets, window.before, window.context)
            self.dynamics.loss(predicted, window.bodies[1:], window.valid).backward()
            adam.step()
        self.sets = [self.recorded(share, seed) for seed in (1, 2, 3)]

    def recorded(self, share: float, seed: int) -> Measured:
        return measured(record(8, 40, weakened(share, ANKLES), ANKLES, seed, 0.3), self.model, DT, 31)

    def fitted(self, config: ResidualConfig = CONFIG, learn: Measured | None = None) -> Fitted:
        own, stop, judge = self.sets
        return fit_residual(self.dynamics, own if learn is None else learn, stop, judge, self.simulated, config)


@pytest.fixture(scope="module")
def weak() -> Lab:
    return Lab(0.3)


@pytest.fixture(scope="module")
def fitted(weak: Lab) -> Fitted:
    return weak.fitted()


def test_an_untrained_residual_changes_nothing_and_a_model_with_none_is_the_model(weak: Lab) -> None:
    window = weak.sets[0].windows(weak.sets[0].first_rows(4), 4)
    first = (window.bodies[0].clone(), window.targets, window.before, window.context)
    for whole in (corrected(weak.dynamics, new_residual(weak.dynamics, (8,))), corrected(weak.dynamics, None)):
        assert torch.equal(whole.unrolled(*first), weak.dynamics.unrolled(*first))


def test_a_residual_of_a_robot_that_differs_lowers_the_held_out_error_and_is_kept(weak: Lab, fitted: Fitted) -> None:
    change = fitted.gain.change
    assert list(change) == ["0.02", "0.2", "0.6"] and (fitted.gain.rollouts, fitted.gain.motions) == (8, 8)
    assert fitted.gain.promoted and fitted.kept is fitted.residual and fitted.updates > 0
    assert all(each["high"] < 0 for each in change.values()) and fitted.stop[1] < fitted.stop[0]
    errors = predicted_error(corrected(weak.dynamics, fitted.residual), weak.sets[2])
    assert errors["0.6"].mean() == pytest.approx(change["0.6"]["with"], rel=1e-4)


def test_the_model_stays_as_it_was_and_the_fit_is_repeated_by_its_seed(weak: Lab, fitted: Fitted) -> None:
    before = deepcopy(weak.dynamics.state_dict())
    again = weak.fitted()
    assert again.updates == fitted.updates
    for name, value in weak.dynamics.state_dict().items():
        assert torch.equal(value, before[name]), name
    for name, value in again.residual.state_dict().items():
        assert torch.equal(value, fitted.residual.state_dict()[name]), name


def test_a_residual_that_the_other_rollouts_do_not_bear_out_is_dropped(weak: Lab) -> None:
    recordings = weak.sets[0].recordings
    order = torch.randperm(len(weak.sets[0].bodies), generator=torch.Generator().manual_seed(0))
    nonsense = Measured(recordings, weak.sets[0].bodies[order])
    fitted = weak.fitted(learn=nonsense)
    assert fitted.kept is None and not fitted.gain.promoted and fitted.gain.reason
    assert fitted.updates == 0 or fitted.stop[1] < fitted.stop[0]


def test_on_simulated_states_a_louder_penalty_keeps_it_quieter(weak: Lab) -> None:
    torch.manual_seed(0)
    own = weak.simulated.windows(1, 200)
    seen = weak.dynamics.seen(own.bodies[0], own.targets[0], own.before, own.context)

    def size(residual: nn.Module) -> float:
        return float(residual((seen - weak.dynamics.mean) / weak.dynamics.std).square().mean())

    loud, quiet = (weak.fitted(replace(CONFIG, quiet=weight, updates=40)) for weight in (0.0, 1.0))
    assert size(quiet.residual) < 0.5 * size(loud.residual)
