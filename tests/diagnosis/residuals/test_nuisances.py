"""Differences by the truth's integrator are no effect, whatever integrator the model declares."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.estimation import gauss_newton
from bumblebee.diagnosis.residuals import make_problem
from bumblebee.diagnosis.simulation import choose_starts, cut
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.residuals import ResidualThresholds, Whitening
from bumblebee.measured.rollout import Rollout
from tests.diagnosis.arm import session_of

PENDULUM = """<mujoco><compiler angle="radian"/><option timestep=".004" integrator="INTEGRATOR"/><worldbody>
<body><joint name="swing" axis="0 1 0" damping=".02" armature=".002"/>
<inertial pos="0 0 -.2" mass=".5" diaginertia=".002 .002 .001"/></body></worldbody>
<actuator><position joint="swing" kp="3" kv=".1"/></actuator></mujoco>"""


def _recorded(truth: str, step: float = 0.001) -> list[Rollout]:
    """Logs at 100 Hz by next to noise-free sensors."""
    rng, rollouts = np.random.default_rng(0), []
    model = mujoco.MjModel.from_xml_string(PENDULUM.replace("INTEGRATOR", truth))
    model.opt.timestep, time = step, np.arange(300) / 100
    for k in range(2):
        data, states = mujoco.MjData(model), []
        data.qpos[0] = rng.uniform(-0.5, 0.5)
        target = 0.8 * np.sin(2 * np.pi * rng.uniform(0.3, 1.5, (2, 1)) * time + rng.uniform(0, 6, (2, 1))).sum(axis=0)
        for value in target:
            states.append([data.qpos[0], data.qvel[0]])
            data.ctrl[0] = value
            mujoco.mj_step(model, data, round(0.01 / step))
        q, v = np.array(states).T[:, :, None]
        noise = rng.standard_normal((2, 300, 1)) * [[[1e-6]], [[1e-5]]]
        rollouts.append(
            Rollout(f"r{k}", ("swing",), 100.0, time, q + noise[0], v + noise[1], joint_target=target[:, None])
        )
    return rollouts


@pytest.mark.parametrize("declared", ["RK4", "Euler"])
def test_another_integrator_leaves_little_that_the_nuisances_do_not_take(declared: str) -> None:
    session = session_of(_recorded("implicit"), PENDULUM.replace("INTEGRATOR", declared))
    starts = choose_starts(session.rollouts, [0, 1], 0.2, 20)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    steps = (session.search_step, session.steps[1])
    # As large as the noise alone makes it: without each window's own numerical error in its covariance.
    residuals = replace(ResidualThresholds(), whitening=Whitening(stepped=0.0))
    problem = make_problem(
        session.plant, session.layout, windows, session.sigma, steps, [], np.random.default_rng(0),
        thresholds=replace(Thresholds(), residuals=residuals),
    )  # fmt: skip
    fit = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    raw, left = (float(np.mean(r**2)) for r in (problem.residual([[]])[0], fit.clean(problem)))
    assert raw > 100 and left < 0.02 * raw
