import math
from copy import deepcopy
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from climbs import LIMIT, PERIOD, Climb
from test_reversals import PATHS, Odd

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.guard import Guard, GuardOptions
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import Suction
from climber_uk.mechanics.contact import Contact, Tracked
from climber_uk.mechanics.friction import Stribeck
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors

pytestmark = pytest.mark.slow
soak = pytest.mark.soak


@cache
def healthy(scrubs, until):
    """Climb that goes well until some time [s]; without motion of its wheels, with what resists."""
    climb = deepcopy(healthy(scrubs, until - 6.0)) if until > 6.0 else Climb(scrubs=scrubs)
    climb.run(until - climb.time)
    assert not any(mode.is_fault for mode in climb.modes)
    return climb


def dead(side, since):
    """Motors of which one has no torque any more."""

    def motors(time, torques):
        alive = np.ones(2)
        alive[side] = time < since
        return torques * alive

    return motors


@pytest.mark.parametrize(
    "since", [0.0, pytest.param(2.0, marks=soak), pytest.param(4.0, marks=soak)]
)
@pytest.mark.parametrize(
    ("wiring", "scrubs", "parameters"),
    [
        pytest.param(-np.eye(2), False, {}, id="both"),
        pytest.param(np.diag([1, -1]), False, {}, id="left"),
        pytest.param(np.diag([-1, 1]), False, {}, id="right", marks=soak),
        pytest.param(np.eye(2)[::-1], False, {}, id="swapped", marks=soak),
        pytest.param(-np.eye(2)[::-1], False, {}, id="both, swapped", marks=soak),
        pytest.param(-np.eye(2), True, {}, id="both, tracks", marks=soak),
        pytest.param(np.diag([1, -1]), True, {}, id="left, tracks", marks=soak),
        pytest.param(np.diag([-1, 1]), True, {}, id="right, tracks", marks=soak),
        pytest.param(np.eye(2)[::-1], True, {}, id="swapped, tracks", marks=soak),
        pytest.param(-np.eye(2), False, {"adhesion": "none"}, id="both, nothing rubs"),
    ],
)
def test_motors_that_turn_the_wrong_way_round_do_not_run_away(wiring, scrubs, parameters, since):
    """Neither by the brake of the safe output, nor by the weight that it carries."""
    climb = Climb(scrubs=scrubs, **parameters).run(since)
    climb.run(3.0, motors=lambda _, torques: wiring @ torques)
    assert climb.controller.guard.faults
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1


@pytest.mark.parametrize("since", [2.0, pytest.param(4.0, marks=soak)])
def test_swapped_motors_are_braked_on_a_floor_where_nothing_rubs(since):
    """Nothing pulls the climber there, and nothing but its motors stops it."""
    climb = Climb(inclination=0.0, adhesion="none").run(since)
    climb.run(2.0, motors=lambda _, torques: torques[::-1])
    assert climb.controller.guard.faults
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(climb.time - 0.2) < 0.01


@pytest.mark.soak
def test_one_motor_the_wrong_way_round_does_not_run_away_where_nothing_rubs():
    climb = Climb(inclination=0.0, adhesion="none").run(4.0)
    climb.run(2.0, motors=lambda _, torques: torques * [1, -1])
    assert climb.fastest(4.0) < 1.5 * climb.reference_speed + 0.1


def deaths():
    """When which motor dies, and on what; but for soak each side once, and tracks once."""
    for turn, since in enumerate((1.0, 7.0, 13.0, 19.0)):
        for side, name in enumerate(("right", "left")):
            others = () if side == turn else soak
            yield pytest.param(since, False, side, id=f"{since}-two wheels-{name}", marks=others)
            others = () if (turn, side) == (0, 1) else soak
            yield pytest.param(since, True, side, id=f"{since}-tracks-{name}", marks=others)


@pytest.mark.parametrize(("since", "scrubs", "side"), deaths())
def test_a_dead_motor_is_noticed_and_the_climber_comes_to_rest(side, scrubs, since):
    climb = deepcopy(healthy(scrubs, since))
    climb.run(3.0, motors=dead(side, since))
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1
    # on tracks that hold its heading, one motor can do for a while what two should
    assert climb.faulty_after(since) < 0.3 + climb.harmless(since)
    assert climb.fastest(climb.time - 0.5) < 0.01
    if scrubs:  # nothing but the motor that died resists the turn of the other one
        assert climb.fastest_turn(climb.time - 0.5) < 0.01


@soak
@pytest.mark.parametrize("since", [1.0, 7.0, 13.0])
@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("side", [0, 1], ids=["right", "left"])
@pytest.mark.parametrize("scrubs", [False, True], ids=["wheels", "tracks"])
def test_a_motor_with_part_of_its_torque_lets_nothing_run_away(scrubs, side, share, since):
    """It is a disturbance that is learnt, or a fault."""
    climb, shares = deepcopy(healthy(scrubs, since)), np.ones(2)
    shares[side] = share
    climb.run(8.0, motors=lambda _, torques: torques * shares)
    faults = dict.fromkeys(mode.name for mode in climb.since(since, climb.modes) if mode.is_fault)
    print(f"{climb.fastest(since):.2f} m/s, {climb.off_the_path(since):.3f} m, {', '.join(faults)}")
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1
    assert climb.off_the_path(since) < 0.05


RAMPS = {"time_law": "rest_to_rest", "rest_to_rest.ramp_time": 2.0}
BENDS = {
    "circle": {**RAMPS, "shape": "circle", "circle.radius": 0.5, "rest_to_rest.rate": 0.4},
    "sine": {
        **RAMPS,
        "shape": "sine_wave",
        "sine_wave.length": 2.0,
        "sine_wave.amplitude": 0.2,
        "sine_wave.wavelength": 1.0,
        "rest_to_rest.rate": 0.15,
    },
}


@soak
@pytest.mark.parametrize(
    ("path", "scrub", "length", "friction", "mass"),
    [
        ("circle", 0.85, 0.73, 0.81, 0.95),
        ("sine", 0.9, 0.73, 0.75, 1.12),
    ],
)
def test_a_climber_that_needs_most_of_its_torque_for_its_turns_is_not_stopped(
    path, scrub, length, friction, mass
):
    contact = Contact(locomotion=Tracked(scrub_friction_coefficient=scrub, length=length))
    climb = Climb(planner=BENDS[path], scrubs=contact, truth=Odd(friction, mass).true).run(8.0)
    assert not climb.controller.guard.faults
    assert np.quantile(np.abs(climb.sent).max(axis=1), 0.9) > 0.7 * LIMIT


def test_a_dead_wheel_is_named_and_waits_for_somebody():
    climb = deepcopy(healthy(False, 13.0))
    for _ in range(12):
        climb.run(1.0, motors=dead(0, 13.0))
        if climb.controller.mode is Mode.DEAD_WHEEL:
            break
    assert climb.controller.mode is Mode.DEAD_WHEEL
    assert climb.controller.detail.startswith("the right one, at ")
    assert climb.controller.detail.endswith("~/enable to go on")
    climb.controller.enable(True)
    for _ in range(25):  # it may have to turn round first
        climb.run(1.0)
        if climb.follows():
            break
    climb.run(2.0)
    assert climb.follows()
    assert climb.off_the_path(since=climb.time - 1.0) < 0.02


def test_motors_that_are_too_weak_stall_safely_and_give_up_after_some_attempts():
    climb = deepcopy(healthy(False, 7.0))
    guard = climb.controller.guard
    guard.options = replace(guard.options, attempts=2)
    for _ in range(45):
        climb.run(1.0, motors=lambda _, torques: 0.1 * torques)
        if guard.is_for_good:
            break
    assert len(guard.faults) == 2
    assert climb.controller.mode in (Mode.STALLED, Mode.DISTURBED, Mode.OFF_PATH)
    assert climb.controller.detail.endswith("~/enable to go on")
    assert climb.fastest(7.0) < climb.reference_speed


@pytest.mark.parametrize(
    ("turned", "seconds"),
    [
        pytest.param(
            turned, seconds, marks=() if (name, seconds) == ("back", 0.3) else soak, id=name
        )
        for name, turned in (("ahead", 0.0), ("back", 3.1), ("around", 1.6))
        for seconds in (0.25, 0.3)
    ],
)
def test_a_push_is_ridden_out_and_the_path_goes_on_where_it_was_left(turned, seconds):
    climb = deepcopy(healthy(False, 7.0))
    active = climb.state.heading + turned
    climb.run(seconds, push=150.0 * np.array([np.cos(active), np.sin(active), 0.02]))
    for _ in range(45):  # it may have to turn round, and drive there at `approach_speed`
        climb.run(1.0)
        since = climb.time - 1.0
        if set(climb.since(since, climb.modes)) == {Mode.FOLLOWING}:
            break
    assert climb.follows()
    assert climb.off_the_path(since) < 0.02
    assert 7.0 < climb.position < climb.time


def test_a_speed_is_a_fault_only_where_two_odometries_in_a_row_tell_it():
    climb = deepcopy(healthy(False, 7.0))
    begin = climb.time

    def glitch(at, seconds):
        def odometry(time, state):
            if not 0 <= time - at < seconds - 1e-9:
                return state
            return State.rolling(state.pose, 0.8, state.yaw_rate)

        return odometry

    climb.run(0.5, odometry=glitch(begin + 0.1, 0.005))
    assert climb.follows()
    climb.run(0.5, odometry=glitch(climb.time + 0.1, 0.015))
    assert Mode.TOO_FAST in climb.since(begin, climb.modes)


@pytest.mark.parametrize(
    ("option", "switched_off"),
    [("speed_margin", True), ("max_disturbance", False), ("response_time", False)],
)
def test_each_check_can_be_switched_off(option, switched_off):
    climb = Climb(**{f"guard.{option}": 0.0}).run(2.0)
    climb.run(0.02, odometry=lambda _, state: State.rolling(state.pose, 0.8, state.yaw_rate))
    assert (climb.controller.mode is not Mode.TOO_FAST) == switched_off


def late(counts, **times):
    """What is between a controller and a climber whose odometry comes from encoders."""
    wheels = Sensors(odometry_source="wheels", encoder_resolution=math.tau / counts)
    return Link(sensors=wheels, **times)


@pytest.mark.parametrize(
    ("link", "share_of_friction", "share_of_mass", "breakaway"),
    [
        pytest.param(
            *(late(8192, period=0.02, torque_lag=0.0192, delay=0.0075), 0.65, 0.86, 1.2), marks=soak
        ),
        (late(2048, period=0.02, torque_lag=0.0188, delay=0.0075), 0.54, 0.93, 1.15),
        pytest.param(*(late(4096, period=0.02, torque_lag=0.0128), 1.29, 0.95, 1.54), marks=soak),
        (late(4096, period=0.01, torque_lag=0.0143, delay=0.0075), 1.49, 1.0, 1.4),
        pytest.param(*(late(4096, torque_lag=0.0068, delay=0.0075), 1.45, 0.96, 1.55), marks=soak),
    ],
    ids=["slips away", "slips most", "sticks", "sticks most", "sticks at 200 Hz"],
)
def test_friction_that_is_not_as_believed_is_no_runaway_however_late_the_loop_answers(
    link, share_of_friction, share_of_mass, breakaway
):
    climb = Climb()
    run = assert_is_never_stopped(climb, link, share_of_friction, share_of_mass, breakaway, 5.5)
    speed = np.hypot(run.velocity[:, 0], run.velocity[:, 1])
    assert speed.max() < 2.4 * climb.reference_speed
    there = climb.trajectory.at(climb.position).pose  # the reference waits until it moves
    assert np.hypot(*(run.pose[-1] - there)[:2]) < 5e-3


def assert_is_never_stopped(climb, link, share_of_friction, share_of_mass, breakaway, seconds):
    """Run of a climber that is other than believed."""
    controller, believed = climb.controller, climb.controller.law.climber
    true = replace(
        believed,
        mass=share_of_mass * believed.mass,
        seal_friction_coefficient=share_of_friction * believed.seal_friction_coefficient,
    )
    contact = Contact(friction=Stribeck(ratio=breakaway))
    run = simulate(
        climb.trajectory,
        climb.state,
        seconds,
        controller,
        true,
        link,
        plant_of=partial(Plant, contact=contact),
    )
    assert not controller.guard.faults
    assert controller.mode is Mode.FOLLOWING
    return run


TURNS_BACK = {
    "shape": "sine_wave",
    "sine_wave.length": 0.6,
    "sine_wave.amplitude": 0.1,
    "sine_wave.wavelength": 0.6,
    "time_law": "rest_to_rest",
    "rest_to_rest.rate": 0.25,
    "rest_to_rest.ramp_time": 0.5,
    "rest_to_rest.runs": 0,
    "rest_to_rest.pause": 0.0,
}


@pytest.mark.parametrize(
    ("link", "share_of_friction", "share_of_mass", "breakaway"),
    [
        (late(4096, period=0.02, torque_lag=0.0177), 1.22, 1.08, 1.35),
        (late(4096, period=0.01, torque_lag=0.0198, delay=0.0075), 0.67, 1.04, 1.53),
        *(
            pytest.param(*it, marks=soak)
            for it in [
                (late(4096, period=0.02, torque_lag=0.0190, delay=0.0075), 1.25, 1.11, 1.31),
                (late(8192, period=0.02, torque_lag=0.0155, delay=0.0025), 1.41, 0.89, 1.45),
                (late(4096, period=0.015, torque_lag=0.0169, delay=0.0025), 1.21, 1.13, 1.56),
                (late(4096, period=0.02, torque_lag=0.0195, delay=0.0025), 1.40, 1.11, 1.53),
                (late(4096, period=0.015, torque_lag=0.0188, delay=0.0025), 1.07, 0.85, 1.40),
            ]
        ),
    ],
)
def test_a_seal_that_breaks_loose_at_each_reversal_is_no_fault(
    link, share_of_friction, share_of_mass, breakaway
):
    """Odometry at 50 to 100 Hz, lazy motors, friction at rest up to 2.1 times the model's."""
    climb = Climb(planner=TURNS_BACK)
    assert_is_never_stopped(climb, link, share_of_friction, share_of_mass, breakaway, 8.0)


def test_faults_count_for_a_while_only():
    guard, fault = Guard(GuardOptions(attempts=2, memory=10.0), Suction()), (Mode.STALLED, "")
    for time, is_for_good in ((1, False), (20, False), (29, True)):
        guard.count(time * SECOND, fault)
        assert guard.is_for_good is is_for_good


def test_torques_stay_within_the_limit_whatever_is_wrong():
    climb = deepcopy(healthy(False, 7.0))
    climb.run(3.0, motors=dead(1, 7.0))
    assert max(np.abs(torques).max() for torques in climb.sent) <= LIMIT


def by_encoders(stuck):
    """Odometry by dead reckoning of wheels of which one's encoder, 0 right or 1 left, is stuck."""
    places = []

    def lie(_, state):
        d = 0.3
        rims = [state.forward_speed + d * state.yaw_rate, state.forward_speed - d * state.yaw_rate]
        rims[stuck] = 0.0
        v, omega = sum(rims) / 2, (rims[0] - rims[1]) / (2 * d)
        x, y, heading = places[-1] if places else state.pose
        middle = heading + omega * PERIOD / 2
        moved = PERIOD * v * np.array([np.cos(middle), np.sin(middle)])
        places.append(np.array([x + moved[0], y + moved[1], heading + PERIOD * omega]))
        return State.rolling(places[-1], v, omega)

    return lie


@pytest.mark.parametrize(
    ("scrubs", "since", "stuck"),
    # from the start; soon after; under way; where the right wheel goes at 3 cm/s
    [
        pytest.param(
            scrubs,
            since,
            stuck,
            marks=() if (scrubs, since, stuck) in [(True, 0.0, 0), (False, 7.0, 1)] else soak,
            id=f"{'tracks' if scrubs else 'wheels'}-{since}-{stuck}",
        )
        for scrubs in (False, True)
        for since in (0.0, 1.0, 7.0, 8.0)
        for stuck in (0, 1)
    ],
)
def test_an_encoder_that_is_stuck_is_found_where_odometry_is_made_of_it(stuck, scrubs, since):
    climb = deepcopy(healthy(scrubs, since)).run(3.0, odometry=by_encoders(stuck))
    assert climb.controller.detail.startswith(("the right one", "the left one")[stuck])
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(since + 2.5) < 0.01


def test_a_climber_that_is_let_go_for_its_wiring_and_falls_is_caught():
    """Its drive seemed to go against its torques, and its seal holds less than is believed."""
    climb = Climb(planner=PATHS["uphill"], truth=Odd(friction=0.5).true).run(2.0)
    safe_output = climb.controller._safe_output
    safe_output.polarities.restart()
    safe_output._way = -1
    climb.controller._find_mode = lambda now: (Mode.TOO_FAST, "")
    climb.run(2.0)
    assert climb.fastest(2.0) < 0.6
    assert climb.fastest(3.5) < 0.01


def test_a_seal_that_holds_less_than_the_weight_lets_nothing_fall_in_the_safe_output():
    climb = Climb(planner=PATHS["uphill"], truth=Odd(friction=0.5).true)
    sent, acting = [np.zeros(2)] * 3, np.zeros(2)

    def late(_, torques):  # by 15 ms, and lazy
        nonlocal acting
        sent.append(torques)
        acting = acting + (1 - np.exp(-PERIOD / 0.02)) * (sent[-4] - acting)
        return acting

    climb.run(4.0, motors=late)
    assert Mode.TOO_FAST in climb.modes
    assert climb.fastest() < 0.6


@pytest.mark.parametrize("seal", [0.6, 0.0])
@pytest.mark.parametrize("mass", [50.0, 5000.0])
def test_a_weight_that_is_believed_far_too_high_is_not_carried_up_the_wall(mass, seal):
    rubs = {"seal_friction_coefficient": seal}
    climb = Climb(mass=mass, **rubs, truth=lambda it: replace(it, mass=5.0, yaw_inertia=0.33))
    climb.run(2.0)  # pounds, grams: 12 and 23 m/s after a second, if all of it is carried
    assert climb.fastest() < 1.1
    assert seal == 0 or climb.fastest(since=1.5) < 0.3


@pytest.mark.parametrize(
    ("turn", "source", "fastest"),
    [
        *((turn, source, 1.4) for turn in (0.5, -0.5) for source in ("odometry", "pose")),
        (-100 / 180, "odometry", 1.0),  # 1.9 where only 5 cm to the side tell it
        pytest.param(100 / 180, "odometry", 1.5, marks=soak),
        *(pytest.param(at / 180, "pose", 1.4, marks=soak) for at in (-120, -100, 100, 120, 135)),
    ],
)
def test_a_heading_that_is_far_off_lets_nothing_run_away(turn, source, fastest):
    def told(_, state):  # as of a camera whose axes are others: x and y of its twist as well
        return State(state.pose + np.array([0.0, 0.0, turn * math.pi]), state.velocity)

    climb = Climb(**{"observer.velocity_source": source}).run(8.0, odometry=told)  # 6 to 20 m/s
    assert Mode.HEADING_WRONG in climb.modes
    assert climb.fastest() < fastest


MAGNETS = {"adhesion": "magnetic", "magnetic.force_at_contact": 400.0}


def heavy(it):
    return replace(it, mass=5.0, yaw_inertia=0.33)


@pytest.mark.parametrize("mass", [2.3, pytest.param(3.0, marks=soak)])
def test_a_weight_that_is_believed_too_low_is_carried_by_who_is_disabled(mass):
    """14 m/s after 4 s, if no more is carried than is believed."""
    climb = Climb(mass=mass, truth=heavy, **MAGNETS).run(1.0)
    climb.controller.enable(False)
    climb.run(1.5)
    assert climb.fastest(1.0) < 0.2
    assert climb.fastest(2.3) < 0.05


@pytest.mark.parametrize(
    ("adhesion", "lag"), [({"adhesion": "none"}, 0.03), pytest.param(MAGNETS, 0.015, marks=soak)]
)
@pytest.mark.parametrize("mass", [2.3, pytest.param(3.0, marks=soak)])
def test_nor_does_it_fall_that_had_no_time_to_learn_its_weight(mass, adhesion, lag):
    acting = np.zeros(2)

    def lazy(_, torques):
        nonlocal acting
        acting = acting + (1 - np.exp(-PERIOD / lag)) * (torques - acting)
        return acting

    climb = Climb(mass=mass, truth=heavy, **adhesion).run(2.5, motors=lazy)
    assert climb.fastest() < 0.48


@pytest.mark.parametrize("since", [0.0, pytest.param(4.0, marks=soak)])
def test_motors_that_give_a_third_of_what_they_should_let_nothing_fall(since):
    climb = Climb(**MAGNETS).run(since).run(4.0, motors=lambda _, torques: 0.3 * torques)
    assert climb.fastest(since) < 2.2  # m/s; 11 to 14 where a fall looks like reversed motors
    assert climb.fastest(climb.time - 0.5) < 1.5
