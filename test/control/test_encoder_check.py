"""Encoders as a witness of odometry: by what they may differ, and an estimator that is stuck."""

import math
from dataclasses import replace

import pytest
from climbs import Climb
from test_lies import frozen

from climber_uk.control.encoder_check import EncoderCheck
from climber_uk.control.safety import Mode
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion

CLIMBER, PERIOD, MOST = Climber(), 0.01, 0.005
ON = {"guard.encoder_distance": MOST}


def troubles(speed, yaw_rate, share, seconds=1.0, silent_after=math.inf, anew=math.inf):
    """What is found of a motion whose wheels turn by a share of it; '' is left out."""
    check, found, angles = EncoderCheck(), [], [3.0, -2.0]
    motion = Motion(0.0, 0.0, 0.0, 1.0, 0.0, speed, yaw_rate)
    for number in range(round(seconds / PERIOD)):
        if number * PERIOD < silent_after:
            check.turn(CLIMBER, *(math.remainder(angle, anew) for angle in angles))
        check.go(CLIMBER, motion, PERIOD)
        rates = CLIMBER.rim_rates(motion)
        angles = [angle + share * PERIOD * rate for angle, rate in zip(angles, rates, strict=True)]
        found.append(check.trouble(MOST))
    return [*filter(None, found)]


def test_angles_may_begin_anew_each_turn():
    for speed in (0.5, -0.5):
        assert not troubles(speed, 0.3, 1.0, anew=2 * math.pi)


@pytest.mark.parametrize(("speed", "yaw_rate"), [(0.2, 0.0), (-0.2, 0.0), (0.0, 0.5), (0.2, -1.0)])
@pytest.mark.parametrize(
    ("share", "is_trouble"), [(1.0, False), (0.75, False), (1.4, False), (0.0, True), (-1.0, True)]
)
def test_wheels_may_slip_a_little_and_not_stand_while_odometry_goes(
    speed, yaw_rate, share, is_trouble
):
    assert bool(troubles(speed, yaw_rate, share)) == is_trouble


def test_encoders_that_are_not_heard_are_no_witness():
    assert not troubles(0.2, 0.0, 0.0, silent_after=0.0)
    assert not troubles(0.01, 0.0, 0.0, seconds=20.0, silent_after=0.3)


def test_the_wheel_is_named_and_both_ways_are_told():
    assert troubles(0.0, 0.5, 0.0)[0].startswith("the right one by 0.000 m, 0.00")
    assert EncoderCheck().trouble(MOST) == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("friction", "seconds"),  # until it does not try again
    [(0.5, 3.0), pytest.param(1.0, 8.0, marks=pytest.mark.soak), (1.5, 3.0)],
)
@pytest.mark.parametrize(
    "scrubs", [False, pytest.param(True, marks=pytest.mark.soak)], ids=["wheels", "tracks"]
)
def test_odometry_that_is_stuck_from_the_start_lets_nothing_run_away(friction, seconds, scrubs):
    def truth(it):
        coefficient = friction * it.seal_friction_coefficient
        return replace(it, seal_friction_coefficient=coefficient)

    climb = Climb(scrubs=scrubs, truth=truth, **ON)
    climb.run(seconds, odometry=frozen(pose=True, twist=True)())
    print(f"friction x {friction}: {climb.faulty_after(0):.2f} s, {climb.fastest():.2f} m/s")
    # a seal that holds it moves no wheel: then it has stalled
    assert climb.controller.mode in (Mode.WHEELS_DIFFER, Mode.STALLED)
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(climb.time - 0.5) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("friction", [pytest.param(1.0, marks=pytest.mark.soak), 1.5])
def test_a_healthy_climber_has_no_trouble_with_its_encoders(friction):
    def truth(it):
        coefficient = friction * it.seal_friction_coefficient
        return replace(it, seal_friction_coefficient=coefficient)

    climb = Climb(scrubs=True, truth=truth, **ON).run(4.0)
    assert not any(mode.is_fault for mode in climb.modes)
