"""What the loop bears that nobody told it, and what it learns of that."""

from dataclasses import replace

import numpy as np
import pytest
from identification_experiments import SCENARIOS

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.approach import ANYWHERE
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.guard import UNGUARDED
from climber_uk.control.guidance import Guidance
from climber_uk.control.safety import Mode, Safety
from climber_uk.control.timing import (
    FASTEST_CHANGE,
    SLOWLY,
    Latency,
    Oscillation,
    Sample,
    Timing,
)
from climber_uk.simulation.sensors import Sensors

BUILT = SCENARIOS["climber.yaml"]
WHEELS = Sensors(odometry_source="wheels", encoder_resolution=2 * np.pi / 4096)
ENCODERS = Link(sensors=WHEELS, delay=0.005, torque_lag=0.005)


def drive(link, guidance=BUILT.guidance, climber=BUILT.believed, duration=8.0, **timing):
    """Run of climber.yaml's climber, and the controller after it."""
    law = ControlLaw(BUILT.believed, guidance)
    settings = Settings(law, timing=Timing(**timing))
    controller = Controller(settings, Safety(), ANYWHERE, UNGUARDED)
    run = simulate(BUILT.trajectory, BUILT.start, duration, controller, climber, link)
    assert controller.mode is Mode.FOLLOWING
    return run, controller.estimator


@pytest.mark.slow
@pytest.mark.parametrize(
    "guidance",
    [BUILT.guidance, pytest.param(Guidance(), marks=pytest.mark.soak)],
    ids=["climber.yaml", "defaults"],
)
@pytest.mark.parametrize(
    "link",
    [
        Link(delay=0.02),
        Link(torque_lag=0.035),
        *(
            pytest.param(
                replace(ENCODERS, period=period), marks=pytest.mark.soak if period < 0.02 else ()
            )
            for period in (0.005, 0.01, 0.02, 0.05)
        ),
        replace(ENCODERS, period=0.05, delay=0.0, torque_lag=0.0),
    ],
    ids=[
        "20 ms of delay",
        "35 ms of lag",
        *(f"{hz} Hz" for hz in (200, 100, 50, 20)),
        "late twist",
    ],
)
def test_what_nobody_told_ends_in_no_limit_cycle(link, guidance):
    run, _ = drive(link, guidance)
    assert run.rms() < 2e-3
    assert run.chatter(1.0) < 0.05  # before, friction is overcome in a step


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_model_that_is_wrong_as_well_ends_in_no_limit_cycle(seed):
    random = np.random.default_rng(seed)
    off = {name: random.uniform(0.8, 1.2) for name in ("mass", "yaw_inertia")}
    off["seal_friction_coefficient"] = random.uniform(0.5, 1.5)
    true = replace(
        BUILT.believed,
        **{name: share * getattr(BUILT.believed, name) for name, share in off.items()},
    )
    run, _ = drive(replace(ENCODERS, period=0.02, delay=0.0075, torque_lag=0.02), climber=true)
    assert run.rms(4.0) < 2e-3
    assert run.chatter(4.0) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("delay", [pytest.param(0.03, marks=pytest.mark.soak), 0.04])
def test_a_delay_beyond_the_margin_is_learnt_in_time(delay):
    run, estimator = drive(Link(delay=delay), duration=15.0)
    assert run.rms() < 5e-3
    assert run.chatter(10.0) < 0.05
    assert (
        delay - 0.021 < estimator.latency.delay < 1.3 * delay
    )  # what is beyond the margin, at least
    lost, _ = drive(Link(delay=delay), learn_delay=False, duration=6.0)
    assert lost.chatter(4.0) > 0.05


@pytest.mark.slow
def test_a_delay_that_is_told_but_not_there_is_unlearnt():
    """Of encoders with a slow period, where it would not be borne."""
    run, estimator = drive(replace(ENCODERS, period=0.02), transport_delay=0.05, duration=15.0)
    assert run.chatter(10.0) < 0.05
    assert estimator.latency.delay <= 0


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.5, 1.5])
def test_friction_that_is_wrong_is_taken_for_no_delay(share):
    coefficient = share * BUILT.believed.seal_friction_coefficient
    true = replace(BUILT.believed, seal_friction_coefficient=coefficient)
    _, estimator = drive(Link(), climber=true, duration=5.0)
    assert estimator.latency.delay < 2e-3


def test_an_acceleration_oscillates_once_it_has_gone_to_and_fro_often():
    oscillation = Oscillation()
    steady = [oscillation.add(0.01 * step, 0.995) for step in range(400)]
    noisy = [oscillation.add(4.0 + 0.1 * (-1) ** step, 0.995) for step in range(400)]
    assert not any(steady + noisy)
    swinging = [oscillation.add(4.0 + np.sin(0.15 * step), 0.995) for step in range(400)]
    assert swinging[-1]
    assert not any(swinging[:60])  # the first two seconds of its periods


def test_a_delay_is_found_from_a_swing_and_changes_no_faster_than_it_may():
    latency, time, delay, delays = Latency(), 0.005, 0.012, []
    for step in range(2000):
        now, before = (np.sin(20 * (step - late) * time) for late in (0, 1))
        error = -(delay - latency.delay) * (now - before)
        latency.learn(Sample((float(now), 0.0), (float(error), 0.0), time), (0.0, 0.0))
        delays.append(latency.delay)
    assert delays[-1] == pytest.approx(delay, rel=0.01)
    assert np.abs(np.diff(delays)).max() <= FASTEST_CHANGE * time * (1 + 1e-9)


def test_a_delay_stays_within_its_bounds():
    for sign in (1.0, -1.0):
        latency = Latency()
        for step in range(2000):
            swing = (-1.0) ** step
            sample = Sample((swing, swing), (-sign * swing, -sign * swing), 0.005)
            latency.learn(sample, (0.0, 0.0), configured_delay=0.01)
        assert latency.delay == (SLOWLY if sign > 0 else -0.01)
        assert latency.is_far_off is (sign > 0)
