"""`python bench/margins.py`: the longest delay and lag that nobody told and the loop bears.

Linear: about a straight path at constant speed the sampled loop is a matrix from one odometry to
the next, of the climber, its motors, what is on its way, and the controller; it stands while all
eigenvalues lie in the unit circle. Simulated: by bisection, with the controller as the nodes run
it, first without and then with `learn_delay`.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from identification_experiments import SCENARIOS as RUNS
from identification_experiments import Scenario
from scipy.linalg import expm

from climber_uk.closed_loop.simulate import Link, Run, simulate
from climber_uk.control.approach import ANYWHERE
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.guard import UNGUARDED
from climber_uk.control.guidance import HEADING_SHARE, Guidance
from climber_uk.control.model import Observer
from climber_uk.control.safety import Safety
from climber_uk.mechanics import Array

MILLISECOND = 1e-3
LONGEST = 0.2  # [s] that is looked for
OFF, CHATTER = 5e-3, 0.05  # [m] RMS distance and [N m] RMS change of a torque: it does not stand


# with the speed [m/s] about which the loop is taken linear
SCENARIOS = {
    "climber.yaml": (RUNS["climber.yaml"], 0.26),
    "defaults, as slow": (replace(RUNS["climber.yaml"], guidance=Guidance()), 0.26),
    "paper.yaml": (RUNS["paper.yaml"], 10.0),
}


@dataclass(frozen=True)
class Channel:
    """Drive or turn: ẏ = v θ, θ̇ = ω, ω̇ = u; for the drive y is not there, and θ is the way."""

    speed: float  # v [m/s]
    feedback: Array  # (3,) of u = -feedback (y, θ, ω)

    @classmethod
    def both(cls, gains: Guidance, speed: float) -> "tuple[Channel, Channel]":
        """Of the guidance, along a line."""
        omega, damping = gains.frequency, 2 * gains.damping
        omega_n = HEADING_SHARE * omega
        g = gains.steering(speed)
        turn = [omega_n**2 * g, omega_n**2 + damping * omega_n * g * speed]
        turn += [damping * omega_n + g * speed]
        drive = [0.0, omega**2, damping * omega]
        return cls(0.0, np.array(drive)), cls(speed, np.array(turn))

    def over(self, time: float, lag: float = 0.0) -> tuple[Array, Array]:
        """Matrix (n, n) and input (n,) of `time` [s], with the motor's torque where it lags."""
        size = 4 if lag > 0 else 3
        A = np.zeros((size + 1, size + 1))
        A[0, 1], A[1, 2] = self.speed, 1.0
        A[2, 3] = 1.0  # the motor's torque, or the input
        if lag > 0:
            A[3, 3], A[3, 4] = -1 / lag, 1 / lag
        whole = expm(A * time)
        return whole[:size, :size], whole[:size, size]


def stands(channel: Channel, observer: Observer, period: float, delay: float, lag: float) -> bool:
    """Whether the linear loop does."""
    late = int(delay / period + 1e-9)
    before, after = (
        channel.over(t, lag) for t in (delay - late * period, (late + 1) * period - delay)
    )
    whole, halfway = channel.over(period), channel.over(period / 2)
    size = len(before[1])
    new, newer = observer.shares(period, 0.0) if observer.bandwidth else (0.0, 0.0)

    def step(state: Array) -> Array:
        """The loop's state an odometry later: climber, r, ṙ, last torques, last odometry."""
        body, (r, rate), sent, last = np.split(state, [size, size + 2, size + 4 + late])
        found = body[:3]
        expected = whole[0] @ last + whole[1] * (sent[0] + r)
        off = (found[2] - expected[2]) / period
        r, rate = r + period * rate + new * off, rate + newer * off / period
        u = sent[0]
        for _ in range(2):
            u = -channel.feedback @ (halfway[0] @ found + halfway[1] * (u + r)) - r
        sent = np.concatenate([[u], sent[:-1]])
        body = before[0] @ body + before[1] * sent[late + 1]
        return np.concatenate([after[0] @ body + after[1] * sent[late], [r, rate], sent, found])

    matrix = np.stack([step(unit) for unit in np.eye(size + 7 + late)], axis=1)
    return float(np.abs(np.linalg.eigvals(matrix)).max()) < 1 + 1e-6


def untold(
    scenario: Scenario, controller: Controller, link: Link, learns: bool, duration: float
) -> Run:
    """Run of a controller whom nobody told what its link is like; it `learns` the delay or not."""
    timing = replace(controller.estimator.timing, learn_delay=learns)
    controller.estimator.timing = timing
    path = scenario.trajectory, scenario.start, duration
    return simulate(*path, controller, scenario.believed, link)


def simulated(scenario: Scenario, controller: Controller, link: Link, learns: bool) -> bool:
    """Whether the loop of the nodes stands."""
    run = untold(scenario, controller, link, learns, 15.0)
    return run.rms(7.5) < OFF and run.chatter() < CHATTER


def longest(holds: Callable[[float], bool], step: float) -> float:
    """Longest time [ms], in multiples of `step` [s], up to which it `holds`; by bisection."""
    low, high = 0, round(LONGEST / step)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle * step) else (low, middle)
    return low * step / MILLISECOND


def linear_margins(
    gains: Guidance, speed: float, observer: Observer, period: float
) -> tuple[float, float]:
    """Longest delay and lag [ms], by eigenvalues."""
    channels = Channel.both(gains, speed)

    def holds(delay: float, lag: float) -> bool:
        return all(stands(channel, observer, period, delay, lag) for channel in channels)

    return longest(lambda t: holds(t, 0.0), 5e-4), longest(lambda t: holds(0.0, t), 5e-4)


def simulated_margins(
    scenario: Scenario, make: Callable[[], Controller], period: float = 0.005, learns: bool = False
) -> tuple[float, float]:
    """Longest delay and lag [ms], of the loop that the nodes run with a controller so made."""
    link = Link(period=period)

    def holds(**late: float) -> bool:
        return simulated(scenario, make(), replace(link, **late), learns)

    return (
        longest(lambda t: holds(delay=t), link.step),
        longest(lambda t: holds(torque_lag=t), link.step),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--period", type=float, default=0.005, help="of the odometry [s]")
    parser.add_argument("--bandwidth", type=float, help="of the observer [1/s]")
    for gain, unit in (("frequency", "rad/s"), ("damping", "")):
        parser.add_argument(f"--{gain}", type=float, help=f"of the guidance [{unit}]")
    parser.add_argument("--linear", action="store_true", help="no simulations")
    options = parser.parse_args()
    period = options.period
    print(f"{'delay, lag [ms]':<20}{'linear':>16}{'simulated':>16}{'and learnt':>16}")
    asked = {gain: getattr(options, gain) for gain in ("frequency", "damping")}
    given = {gain: value for gain, value in asked.items() if value is not None}
    for name, (built, speed) in SCENARIOS.items():
        scenario = replace(built, guidance=replace(built.guidance, **given))
        observer = built.observer
        if options.bandwidth is not None:
            observer = replace(observer, bandwidth=options.bandwidth)
        settings = Settings(ControlLaw(scenario.believed, scenario.guidance), observer)

        def make(settings: Settings = settings) -> Controller:
            return Controller(settings, Safety(), ANYWHERE, UNGUARDED)

        cells = [linear_margins(scenario.guidance, speed, observer, period)]
        cells += [
            simulated_margins(scenario, make, period, learns)
            for learns in (False, True)[: 0 if options.linear else 2]
        ]
        print(f"{name:<20}" + "".join(f"{f'{d:.1f}, {lag:.1f}':>16}" for d, lag in cells))


if __name__ == "__main__":
    main()
