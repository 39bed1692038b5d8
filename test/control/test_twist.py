"""Twists that are means of a period are told from those of their stamps."""

import numpy as np
import pytest
from identification_experiments import NOISE, SCENARIOS

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.model import Observer
from climber_uk.control.timing import Timing
from climber_uk.control.twist import mean_twist
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.sensors import Sensors

BUILT = SCENARIOS["climber.yaml"]


def encoders(counts):
    """Sensors of wheels whose encoders count that many steps in a turn."""
    return Sensors(odometry_source="wheels", encoder_resolution=2 * np.pi / counts)


def driven(link, twist="auto", duration=4.0):
    law = ControlLaw(BUILT.believed, BUILT.guidance)
    observer, timing = Observer(twist=twist), Timing(learn_delay=False)
    controller = Controller(Settings(law, observer, timing))
    run = simulate(BUILT.trajectory, BUILT.start, duration, controller, BUILT.believed, link)
    return run, controller.estimator


def test_a_mean_twist_leads_from_one_pose_to_the_other():
    start = State.rolling(np.array([1.0, 2.0, 3.0]), 0.2, 0.5)
    time = 0.02
    turned, way = 0.5 * time, 0.2 * time
    middle = 3.0 + turned / 2
    end = State.rolling(
        start.pose + np.array([way * np.cos(middle), way * np.sin(middle), turned]), 0.2, 0.5
    )
    assert mean_twist(start.motion, end.motion, time) == pytest.approx((0.2, 0.5))


@pytest.mark.parametrize("period", [pytest.param(0.005, marks=pytest.mark.soak), 0.05])
@pytest.mark.parametrize(
    ("sensors", "is_mean"),
    [
        (Sensors(), False),
        (NOISE.sensors, False),
        (Sensors(speed_noise=1e-3, yaw_rate_noise=1e-3), False),
        (encoders(512), True),
        (encoders(65536), True),
    ],
    ids=["truth", "noise", "noise of the twist", "few counts", "many counts"],
)
def test_it_is_told_which_twist_odometry_has(period, sensors, is_mean):
    _, estimator = driven(Link(period=period, sensors=sensors))
    assert estimator.twist.is_mean is is_mean


def test_a_mean_twist_taken_for_one_of_its_stamp_costs_the_margin_of_slow_odometry():
    slow = Link(period=0.05, sensors=encoders(4096), delay=0.005, torque_lag=0.005)
    auto, mean, instantaneous = (
        driven(slow, twist, duration=12.0)[0].chatter(6.0)
        for twist in ("auto", "mean", "instantaneous")
    )
    assert max(auto, mean) < 0.02
    assert instantaneous > 3 * auto
