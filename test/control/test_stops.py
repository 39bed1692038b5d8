"""Emergency stop, battery and tether: a stop lasts until it is over and enabled again."""

import math

import pytest
from test_controller import Loop, is_safe

from climber_uk.control.safety import Mode
from climber_uk.control.stops import StopOptions, Stops
from climber_uk.mechanics import SECOND


def stopped(**options):
    """A climber that follows, with such stops, and the stops."""
    loop = Loop()
    stops = loop.controller.stops = Stops(StopOptions(**options))
    loop.plan()
    return loop, stops


ON = {"emergency_stop": True}
CAUSES = {
    "pressed": (ON, lambda s, now: s.press(True, now), lambda s, now: s.press(False, now)),
    "charge": (
        {"least_charge": 0.2},
        lambda s, now: s.see_battery(0.19, 24.0),
        lambda s, now: s.see_battery(0.21, 24.0),
    ),
    "voltage": (
        {"least_voltage": 22.0},
        lambda s, now: s.see_battery(math.nan, 21.0),
        lambda s, now: s.see_battery(math.nan, 23.0),
    ),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_a_stop_lasts_until_it_is_over_and_enabled_again(cause):
    options, begin, end = CAUSES[cause]
    loop, stops = stopped(**options)
    assert loop.tell() is Mode.FOLLOWING
    begin(stops, loop.now)
    mode = Mode.EMERGENCY_STOP if cause == "pressed" else Mode.LOW_BATTERY
    assert loop.tell() is mode
    assert mode.is_fault
    assert is_safe(loop)
    loop.controller.enable(True)
    assert loop.tell() is mode
    end(stops, loop.now)
    assert loop.tell() is mode
    loop.controller.enable(True)
    assert loop.tell() is Mode.FOLLOWING


@pytest.mark.parametrize("cause", CAUSES)
def test_one_that_was_over_before_the_next_odometry_counts(cause):
    options, begin, end = CAUSES[cause]
    loop, stops = stopped(**options)
    begin(stops, loop.now)
    end(stops, loop.now)
    assert loop.tell() is not Mode.FOLLOWING


def test_an_emergency_stop_that_has_a_timeout_must_be_heard():
    loop, stops = stopped(emergency_stop=True, emergency_timeout=0.3)
    assert loop.tell() is Mode.EMERGENCY_STOP
    assert loop.controller.detail == "not heard yet"
    stops.press(False, loop.now)
    assert loop.tell(times=60) is Mode.FOLLOWING
    assert loop.tell(times=2) is Mode.EMERGENCY_STOP
    assert loop.controller.detail.startswith("silent for 0.3")
    stops.press(False, loop.now)
    assert loop.tell() is Mode.EMERGENCY_STOP
    loop.controller.enable(True)
    assert loop.tell() is Mode.FOLLOWING


def test_without_a_timeout_it_need_not_be_heard():
    loop, _ = stopped(emergency_stop=True)
    assert loop.tell(times=1000) is Mode.FOLLOWING


def test_a_clock_that_goes_back_makes_no_silence_longer():
    stops = Stops(StopOptions(emergency_stop=True, emergency_timeout=1.0))
    stops.press(False, 100 * SECOND)
    assert stops.trouble(0) is None
    assert stops.trouble(SECOND // 2) is None
    assert stops.trouble(2 * SECOND) is not None


def test_the_tether_ends_the_way_and_is_counted_anew_when_enabled():
    """At 0.5 m/s."""
    loop, stops = stopped(tether_length=0.5)
    assert loop.tell(times=190) is Mode.FOLLOWING
    assert loop.tell(times=20) is Mode.TETHER
    assert stops.way == pytest.approx(0.5, abs=0.02)
    loop.controller.enable(True)
    assert stops.way == 0.0
    assert loop.tell() is Mode.FOLLOWING


def test_another_stop_that_is_forgiven_gives_no_more_tether():
    loop, stops = stopped(tether_length=0.5, **ON)
    assert loop.tell(times=100) is Mode.FOLLOWING
    stops.press(True, loop.now)
    stops.press(False, loop.now)
    loop.controller.enable(True)
    assert loop.tell(times=110) is Mode.TETHER


def test_a_pose_that_trembles_goes_no_way():
    loop, stops = stopped(tether_length=0.5)
    for i in range(1000):
        stops.move(loop.state(SECOND).motion._replace(x=0.009 * (i % 2)))
    assert stops.way == 0.0


def test_what_is_asked_for_but_not_measured_is_refused():
    with pytest.raises(ValueError, match="percentage=nan is not measured"):
        Stops(StopOptions(least_charge=0.2)).see_battery(math.nan, 24.0)
    with pytest.raises(ValueError, match="voltage=nan is not measured"):
        Stops(StopOptions(least_voltage=20.0)).see_battery(0.5, math.nan)
    with pytest.raises(ValueError, match=r"emergency_timeout=1.0 \[s\] needs emergency_stop=true"):
        StopOptions(emergency_timeout=1.0)


def test_a_twist_that_is_doubted_is_told_before_a_stop_that_would_brake_by_it():
    loop, stops = stopped(**ON)
    assert loop.tell() is Mode.FOLLOWING
    stops.press(True, loop.now)
    assert loop.tell(moved=(1.0, 0.0, 0.0)) is Mode.JUMPED
    assert loop.tell(moved=(1.0, 0.0, 0.0), times=6) is Mode.EMERGENCY_STOP
