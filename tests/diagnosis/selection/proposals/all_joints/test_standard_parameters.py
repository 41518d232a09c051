"""A robot on a fixed base, whose model has no friction and no rotors: by inverse dynamics, then simulated."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate, all_candidates
from bumblebee.diagnosis.dataset import Session, make_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.quick import first_look, told
from bumblebee.diagnosis.selection.proposals.all_joints import start
from bumblebee.diagnosis.selection.proposals.all_joints.standard_parameters import standard_parameters
from bumblebee.diagnosis.sensitivities import lacking_torque
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import CATALOGUE
from tests.diagnosis import arm, stander

JOINTS = ("j1", "j2", "j3")
ROTORS, DRY, VISCOUS = (0.4, 0.1, 0.02), (2.0, 1.0, 0.3), (3.0, 1.0, 0.2)
STIFF = 'solreffriction="0.004 1" solimpfriction=".999 .999 .001"'
NONE = (0.0, 0.0, 0.0)


def xml(rotors: tuple = NONE, dry: tuple = NONE, viscous: tuple = NONE, tendon: str = "", hand: float = 0.8) -> str:
    """An arm of three joints whose last one rolls; `hand` is the mass of the last link."""
    links = (("0 0 1", 4.0, ".02 0 .1"), ("0 1 0", 2.5, ".03 .02 .2"), ("0 0 1", hand, ".05 .02 .1"))
    bodies = "".join(
        f'<body name="l{k + 1}" pos="0 0 .3"><joint name="j{k + 1}" axis="{axis}" armature="{rotors[k]}" '
        f'frictionloss="{dry[k]}" damping="{viscous[k]}" {STIFF}/>'
        f'<inertial pos="{com}" mass="{mass}" diaginertia=".03 .03 .01"/>'
        for k, (axis, mass, com) in enumerate(links)
    )
    motors = "".join(f'<motor name="{j}" joint="{j}"/>' for j in JOINTS)
    return (
        '<mujoco><compiler angle="radian"/><option timestep=".002" integrator="implicitfast"/><worldbody>'
        f"{bodies}{'</body>' * 3}</worldbody>{tendon}<actuator>{motors}</actuator></mujoco>"
    )


COUPLED = (
    f'<tendon><fixed frictionloss=".5" damping=".4" armature=".03" {STIFF}>'
    '<joint joint="j2" coef="1"/><joint joint="j3" coef="1"/></fixed></tendon>'
)


def rollouts(true: str, arrives: tuple[float, ...] = (1.0, 1.0, 1.0), count: int = 3) -> list[Rollout]:
    """Runs of 4 s at 100 Hz under a PD drive whose torque is logged; the share `arrives` of it reaches the joint."""
    model, made = mujoco.MjModel.from_xml_string(true), []
    model.opt.timestep = 0.0005
    kp, kd = np.array([400.0, 200.0, 40.0]), np.array([40.0, 20.0, 4.0])
    for number in range(count):
        rng, time = np.random.default_rng(number), np.arange(400) / 100
        size, pace, phase = rng.uniform(0.2, 0.5, (3, 3)), rng.uniform(1.5, 7.0, (3, 3)), rng.uniform(0, 6.0, (3, 3))
        target = (size * np.sin(pace * time[:, None, None] + phase)).sum(axis=2)
        data = mujoco.MjData(model)
        data.qpos[:] = target[0]
        rows = []
        for wanted in target:
            torque = kp * (wanted - data.qpos) - kd * data.qvel
            rows.append((data.qpos.copy(), data.qvel.copy(), torque))
            data.ctrl[:] = np.array(arrives) * torque
            mujoco.mj_step(model, data, 20)
        q, v, sent = (np.array(part) for part in zip(*rows, strict=True))
        q, v = q + 2e-5 * rng.standard_normal(q.shape), v + 2e-3 * rng.standard_normal(v.shape)
        made.append(Rollout(f"r{number}", JOINTS, 100.0, time, q, v, joint_torque_cmd=sent))
    return made


def regressed(logs: list[Rollout]) -> list[dict[tuple[str, str], np.ndarray]]:
    """Values by (effect, place) of the regressions: every joint's alone, beside the drives', beside the links'."""
    return _with_friction(_regressed(arm.session_of(logs, xml())))


def servos(truth: dict[tuple[str, str], float], true: str = arm.XML) -> list[dict[tuple[str, str], np.ndarray]]:
    """Those of the arm that is told positions."""
    return _with_friction(_regressed(arm.session_of(arm.simulate(truth, count=3, seconds=6.0, xml=true))))


def _with_friction(several: list[dict[tuple[str, str], np.ndarray]]) -> list[dict[tuple[str, str], np.ndarray]]:
    """Those that are not of strengths alone."""
    return [found for found in several if "coulomb_friction" in {kind for kind, _ in found}]


def _regressed(session: Session) -> list[dict[tuple[str, str], np.ndarray]]:
    problem = arm.problem_of(session, [0, 1, 2], 60)
    every = all_candidates(session.plant, session.rollouts, [])
    return [_by_place(*begun) for begun in standard_parameters(problem, every, 0.005)]


def _by_place(chosen: list[Candidate], values: np.ndarray) -> dict[tuple[str, str], np.ndarray]:
    ends = np.cumsum([len(c.nominal) for c in chosen])
    return {(c.effect, c.where): v for c, v in zip(chosen, np.split(values, ends[:-1]), strict=True)}


TRUE = {(kind, joint): size for kind, sizes in
        (("armature", ROTORS), ("coulomb_friction", DRY), ("viscous_friction", VISCOUS))
        for joint, size in zip(JOINTS, sizes, strict=True)}  # fmt: skip


def test_friction_rotors_and_a_coupled_motor_come_out_near_their_sizes() -> None:
    for found in regressed(rollouts(xml(ROTORS, DRY, VISCOUS, COUPLED)))[1:]:
        for place, size in TRUE.items():
            assert found[place][0] == pytest.approx(size, rel=0.25), place
        assert found["coupled_friction", "j3"] == pytest.approx([0.5, 0.0, 1.0], abs=0.05)
        assert found["coupled_damping", "j3"] == pytest.approx([0.4, 1.0], abs=0.1)
        assert found["coupled_armature", "j3"] == pytest.approx([0.03, 1.0], abs=0.015)
        assert not {kind for kind, _ in found} & {"motor_strength", "link_mass"}


def test_a_drive_that_gives_less_is_told_from_no_drive_at_all() -> None:
    _, drives, links = regressed(rollouts(xml(ROTORS, DRY, VISCOUS), arrives=(1.0, 0.85, 1.0)))
    assert drives["motor_strength", "j2"][0] == pytest.approx(0.85, abs=0.03)
    for place, size in TRUE.items():
        assert drives[place][0] == pytest.approx(size, rel=0.25), place
    assert not any(kind == "motor_strength" for kind, _ in links)


def test_a_load_is_told_at_the_declared_strengths() -> None:
    *_, links = regressed(rollouts(xml(ROTORS, DRY, VISCOUS, hand=1.6)))
    assert links["link_mass", "l3"][0] == pytest.approx(1.6, rel=0.1)


DRAWN = {("coulomb_friction", j): v for j, v in zip(arm.JOINTS, (2.0, 3.0, 0.8), strict=True)}
DAMPING_OF_SERVOS = (3.0, 4.0, 2.0)
ROTORS_OF_SERVOS = {("armature", j): v for j, v in zip(arm.JOINTS, (0.4, 0.6, 0.15), strict=True)}


@pytest.mark.parametrize("late", [0.0, 0.04])
def test_servos_friction_rotors_and_delay_come_out_of_the_targets(late: float) -> None:
    """Nothing comes in beside them; a delay is offered where there is one, and none is asked first."""
    delay = {("command_delay", j): late for j in arm.JOINTS if late}
    several = servos({**DRAWN, **ROTORS_OF_SERVOS, **delay})
    assert several[0]["command_delay", ""] == [0.0]
    found = next(f for f in several if f["command_delay", ""][0] == pytest.approx(late, abs=0.003))
    for place, size in {**DRAWN, **ROTORS_OF_SERVOS}.items():
        assert found[place][0] == pytest.approx(size, rel=0.08), place
    assert {kind for kind, _ in found} == {"coulomb_friction", "viscous_friction", "armature", "command_delay"}


def test_beginnings_to_which_nothing_comes_are_one() -> None:
    alone = [f for f in servos({**DRAWN, **ROTORS_OF_SERVOS}) if len(f) == 10 and f["command_delay", ""] == [0.0]]
    assert len(alone) == 1


def test_damping_below_the_servos_is_a_lower_kd_and_no_friction_below_none() -> None:
    softer = re.sub(r'kv="(\d+)"', lambda m: f'kv="{int(m[1]) / 2}"', arm.XML)
    for found in servos(DRAWN, softer):
        assert [found["kd", j][0] for j in arm.JOINTS] == pytest.approx([0.5] * 3, abs=0.1)
        assert not any(kind == "viscous_friction" for kind, _ in found)


@pytest.mark.parametrize(("effect", "true"), [("kp", 'kp="30" kv="4"'), ("motor_strength", 'kp="30" kv="2"')])
def test_a_servo_of_half_the_kp_or_of_half_the_strength_is_told(effect: str, true: str) -> None:
    """Half the strength and friction for its damping is half the kp: told is what leaves less damping over."""
    several = servos(DRAWN, arm.XML.replace('kp="60" kv="4"', true))
    found = next(f for f in several if (effect, "j2") in f)
    assert found[effect, "j2"][0] == pytest.approx(0.5, abs=0.03)
    assert len({("kp", "j2"), ("motor_strength", "j2")} & set(found)) == 1
    assert found["coulomb_friction", "j2"][0] == pytest.approx(3.0, rel=0.1)
    assert found.get(("viscous_friction", "j2"), np.zeros(1))[0] < 0.3


@pytest.mark.parametrize("truth", [{}, DRAWN])
@pytest.mark.parametrize(("kp", "kd"), [(30, 10), (100, 30)])
def test_a_drive_declared_far_too_strong_is_told_by_where_it_would_not_have_been_at_its_limit(
    truth: dict[tuple[str, str], float], kp: int, kd: int
) -> None:
    """At its declared gains it is always at its limit, whatever the joint does."""
    stiff = re.sub(r'kp="(\d+)"', lambda m: f'kp="{kp * int(m[1])}"', arm.XML)
    declared = re.sub(r'kv="(\d+)"', lambda m: f'kv="{kd * int(m[1])}"', stiff)
    session = arm.session_of(arm.simulate(truth, count=3, seconds=6.0), declared)
    found = _regressed(session)[-1]
    for joint, damping in zip(arm.JOINTS, DAMPING_OF_SERVOS, strict=True):
        assert found["motor_strength", joint][0] == pytest.approx(1 / kp, rel=0.2)
        more = damping * (1 - kd / kp)  # of the declared kd, kd / kp go with the strength
        assert found["viscous_friction", joint][0] == pytest.approx(more, rel=0.3)
        assert found["coulomb_friction", joint][0] == pytest.approx(
            truth.get(("coulomb_friction", joint), 0.0), rel=0.15, abs=0.1
        )


def test_strengths_alone_are_offered_too() -> None:
    """A servo that is four times as stiff moves within a tick, and friction and rotors then explain half of it."""
    session = arm.session_of(arm.simulate({("motor_strength", j): 4.0 for j in arm.JOINTS}, count=3, seconds=6.0))
    found = next(f for f in _regressed(session) if {kind for kind, _ in f} == {"motor_strength", "command_delay"})
    assert all(1.2 < found["motor_strength", j][0] < 5.0 for j in arm.JOINTS)


def test_a_joint_of_a_robot_on_the_ground_is_told_whatever_the_ground_does() -> None:
    rollouts, _ = stander.simulate(
        count=3, xml=stander.XML.replace('armature=".01"', 'armature=".06" frictionloss="1"')
    )
    session = make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "x")
    found = _regressed(session)[0]
    assert found["coulomb_friction", "swing"][0] == pytest.approx(1.0, rel=0.1)
    assert found["armature", "swing"][0] == pytest.approx(0.06, rel=0.3)
    assert not any(kind.startswith("link") for kind, _ in found)


def test_every_conditions_model_stays_as_it_was() -> None:
    """Inverse dynamics are asked of models without drives and constraints; those of the plant keep theirs."""
    logs = [r for k, g in enumerate(((1.0, 1.0), (2.0, 3.0))) for r in arm.simulate(DRAWN, count=1, seed=k, gains=g)]
    session = arm.session_of([replace(r, rollout_id=str(k)) for k, r in enumerate(logs)])
    problem = arm.problem_of(session, [0, 1], 10)
    before = [p.model.opt.disableflags for p in session.plant.every]

    lacking_torque(problem)
    assert len(before) == 2 and [p.model.opt.disableflags for p in session.plant.every] == before


def test_a_robot_a_radian_off_is_brought_to_the_noise() -> None:
    session = arm.session_of(rollouts(xml(ROTORS, DRY, VISCOUS, COUPLED), count=4), xml())
    result = diagnose(session, replace(arm.SMALL, max_windows=40))
    after = {(e.effect, e.where[0]): e.values() for e in result.effects}
    for k, joint in enumerate(JOINTS):
        assert after["coulomb_friction", joint][0] == pytest.approx(DRY[k], rel=0.02), joint
    assert after["coupled_friction", "j3"] == pytest.approx((0.5, 0.0, 1.0), abs=0.02)
    assert _of_wrist(after, "armature") == pytest.approx(np.array([[0.13, 0.03], [0.03, 0.05]]), rel=0.05)
    assert _of_wrist(after, "damping") == pytest.approx(np.array([[1.4, 0.4], [0.4, 0.6]]), rel=0.05)
    assert not {kind for kind, _ in after} - {kind for kind, _ in TRUE} - {e for e in CATALOGUE if "coupled" in e}
    error = result.document["error"]
    before, left = (error[kind]["0.2"]["joint_pos_rmse"]["value"] for kind in ("before", "after"))
    assert before > 0.5 and left < 2e-3


def test_a_first_look_says_all_sizes() -> None:
    look = first_look(arm.session_of(rollouts(xml(ROTORS, DRY, VISCOUS), count=4), xml()))
    found = {(lead.candidate.effect, lead.candidate.where): float(lead.values[0]) for lead in look.leads.together}
    assert found == pytest.approx(TRUE, rel=0.25)
    assert "leads, standard parameters by inverse dynamics, explain" in told(look, "bumblebee diagnose")


def test_a_first_look_at_a_robot_on_the_ground_says_them_as_inverse_dynamics_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is not fitted on in the simulator."""
    monkeypatch.setattr(start, "sure_on_the_ground", None)
    true = stander.XML.replace('armature=".01"', 'armature=".3" frictionloss="2" damping="4"')
    rollouts, _ = stander.simulate(count=4, xml=true)
    look = first_look(make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "x"))
    found = {(lead.candidate.effect, lead.candidate.where): float(lead.values[0]) for lead in look.leads.together}
    assert found["coulomb_friction", "swing"] == pytest.approx(2.0, rel=0.15)
    assert look.leads.together[0].explains > 0.8 and look.leads.alone == []


def _of_wrist(found: dict[tuple[str, str], tuple[float, ...]], what: str) -> np.ndarray:
    """Inertia or damping (2, 2) that effects add to the wrist: with both joints' own no ratio is the only one."""
    own = {"armature": "armature", "damping": "viscous_friction"}[what]
    size, ratio = found[f"coupled_{what}", "j3"]
    motor = np.array([ratio, 1.0])
    return np.diag([found.get((own, joint), (0.0,))[0] for joint in JOINTS[1:]]) + size * np.outer(motor, motor)
