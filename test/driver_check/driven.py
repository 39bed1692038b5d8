"""A driver without ROS: the plant's machine, what it tells, and what it is told by a trial."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from climber_uk.driver_check import listening
from climber_uk.driver_check.evidence import (
    Arrival,
    Endpoint,
    Evidence,
    ExpectedDriver,
    Graph,
    WheelRates,
)
from climber_uk.driver_check.trial import Bounds, Trial
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

CLIMBER = Climber(
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    max_wheel_torque=4.0,
)
START = State.rolling(np.array([0.0, 3.0, 0.785]), 0.0, 0.0)
FRAMES = "odom", "base_link"
PERIOD = 0.005  # [s]
DRIVER = Endpoint("/driver", listening.ODOMETRY, fits=True, reliable=True)
MOTOR = Endpoint("/driver", listening.TORQUES, fits=True, reliable=True)
ALONE = Graph("/odom", odometry=(DRIVER,), commanded=(MOTOR,), elsewhere=(), has_clock=False)


def odometry(pose, twist, stamp, frames=FRAMES, covariance=1e-6):
    """Message of pose (3,) and twist (3,), as reading needs it."""
    x, y, heading = map(float, pose)
    forward, aside, turning = map(float, twist)
    return SimpleNamespace(
        header=SimpleNamespace(
            stamp=SimpleNamespace(sec=stamp // SECOND, nanosec=stamp % SECOND), frame_id=frames[0]
        ),
        child_frame_id=frames[1],
        pose=SimpleNamespace(
            pose=SimpleNamespace(
                position=SimpleNamespace(x=x, y=y, z=0.0),
                orientation=SimpleNamespace(
                    x=0.0, y=0.0, z=np.sin(heading / 2), w=np.cos(heading / 2)
                ),
            ),
            covariance=np.full(36, covariance),
        ),
        twist=SimpleNamespace(
            twist=SimpleNamespace(
                linear=SimpleNamespace(x=forward, y=aside), angular=SimpleNamespace(z=turning)
            ),
            covariance=np.full(36, covariance),
        ),
    )


def arrived(message, age=0):
    """Arrival of a message `age` [ns] after its stamp, on a computer that started at 0."""
    now = message.header.stamp.sec * SECOND + message.header.stamp.nanosec + age
    return Arrival(message, wall=now, boot=now - 1000 * SECOND, simulated=0)


def evidence(arrivals, trial=None, graph=ALONE, **others):
    given = {"expected": ExpectedDriver(), "frames": FRAMES, "use_sim_time": False, **others}
    return Evidence(CLIMBER, graph=graph, arrivals=arrivals, trial=trial, **given)


def tried(
    wheels,
    climber=CLIMBER,
    law=None,
    sensors=None,
    late=0,
    start=START,
    bounds=None,
    stall=None,
    motors=None,
    contact=None,
    slip=False,
    robot=SimulatedRobot,
    expected=None,
):
    """Trial of a driver whose wheels get `wheels` (2, 2) times the torques, `late` periods late.

    In the range of messages `stall` nothing is heard until its end, and the last torque acts on.
    """
    motors, contact = motors or Motors(), contact or Contact()
    contact = contact if law is None else replace(contact, friction=law)
    plant = Plant(climber, PERIOD / 2, contact, slip=slip)
    parts = Parts(plant, motors, sensors or Sensors(), Physics())
    machine = robot(parts, start, PERIOD)
    heard, coming, trial = [], [np.zeros(2)] * late, None
    missed, turning, numbers = [], [], np.zeros(2)
    for number in range(4000):
        _, state = machine.odometer.latest()
        stamp = SECOND + number * 5_000_000
        twist = state.forward_speed, state.side_slip, state.yaw_rate
        heard.append(arrived(odometry(state.pose, twist, stamp)))
        if number == 50:
            trial = Trial(CLIMBER, bounds or Bounds(), heard, PERIOD, stall is not None)
        turning.append(WheelRates(stamp, *machine.rates.tolist()))
        missed.append((stamp, state))
        if stall is None or number not in stall:
            told = None
            for past, at in missed if trial else ():
                told = trial.command(past, stamp, at)
            missed.clear()
            numbers = (told.rates if motors.take_speeds else told.torques) if told else np.zeros(2)
        if trial is not None and trial.stage is None:
            break
        coming.append(np.array(wheels) @ numbers)
        acting = coming.pop(0)
        for _ in range(2):
            machine.advance(acting)
        machine.measure()
    given = {"turning": turning} | ({"expected": expected} if expected else {})
    return evidence(heard, trial.record(), **given)
