"""Climbers drawn at random begin off the path, and are turned and pushed on their way to it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from climbs import Climb
from test_delay_check import Late

from climber_uk.control.safety import Mode
from climber_uk.mechanics.quantities import State

TURNED_BY = 3.0  # [N m] at most, by what nobody knows: a centre of mass beside the axle


@dataclass(frozen=True)
class Start:
    """Where a climber begins, what it is, and how it is heard."""

    delay: float  # [s] of its torques, that nobody told
    offset: tuple[float, float, float] = (0.0, 0.0, -1.2)  # [m, m, rad]
    moment: float = 0.0  # [N m] that turns it
    noise: float = 0.0  # [m] of each odometry; three times as much of an angle and of speeds
    every: int = 1  # odometry of so many
    scrubs: bool = False
    heavier: float = 1.0  # than believed
    inertia: float = 1.0  # beside what is believed
    friction: float = 1.0  # likewise

    @classmethod
    def drawn(cls, seed: int, delays: tuple[float, ...]) -> "Start":
        """Anything at random."""
        draw = np.random.default_rng(seed)
        heavier, inertia, friction = draw.uniform(0.7, [1.2, 1.5, 1.5])
        return cls(
            delay=draw.choice(delays),
            offset=tuple(draw.uniform(-1, 1, 3) * (0.4, 0.4, 2.5)),
            moment=draw.choice([0.0, 1.0, -TURNED_BY]),
            noise=draw.choice([0.0, 1e-4, 5e-4]),
            every=int(draw.choice([1, 2, 4])),
            scrubs=bool(draw.random() < 0.35),
            heavier=heavier,
            inertia=inertia,
            friction=max(0.9, friction),
        )

    def climb(self, seconds: float) -> Climb:
        """The climber, that has been driven for some time."""
        climb = Climb(
            offset=self.offset,
            scrubs=self.scrubs,
            truth=lambda it: replace(
                it,
                mass=it.mass * self.heavier,
                yaw_inertia=it.yaw_inertia * self.inertia,
                seal_friction_coefficient=it.seal_friction_coefficient * self.friction,
            ),
        )
        draw, number = np.random.default_rng(0), 0

        def heard(_: float, state: State) -> State | None:
            nonlocal number
            number += 1
            if number % self.every:
                return None
            off = draw.normal(0.0, self.noise, (2, 3)) * [[1, 1, 3], [3, 3, 6]]
            return replace(state, pose=state.pose + off[0], velocity=state.velocity + off[1])

        motors, push = Late(self.delay, climb.torques), np.array([0.0, 0.0, self.moment])
        return climb.run(seconds, odometry=heard, motors=motors, push=push)


def assert_comes_nearer(climb: Climb) -> None:
    assert not climb.controller.guard.faults
    assert climb.controller.mode in (Mode.APPROACHING, Mode.FOLLOWING)
    assert climb.fastest() < 0.4
    assert climb.fastest_turn() < 2.0


def test_a_turn_is_braked_while_a_push_waits_for_its_answer():
    """2.6 rad/s: nothing braked what turned it in the pause after a first push."""
    start = Start(0.005, (-0.13, -0.1, -0.63), 1.0, heavier=1.2, inertia=1.24, friction=0.96)
    assert_comes_nearer(start.climb(3.5))


@pytest.mark.parametrize("noise", [1e-4, 5e-4])
def test_noise_of_a_climber_that_rests_drives_it_nowhere(noise):
    """18 rad/s and 2.1 m/s: noise of poses was taken for motion, and taught what scrubs."""
    climb = Start(0.16, (0.3, 0.2, -1.3), noise=noise, scrubs=True, heavier=1.4).climb(2.0)
    assert climb.fastest() < 0.6
    assert climb.fastest_turn() < 5.0


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(30))
def test_a_healthy_climber_comes_to_its_path(seed):
    assert_comes_nearer(Start.drawn(seed, (0.0, 0.005, 0.01, 0.02)).climb(6.0))


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(30))
def test_a_late_climber_does_not_run_away(seed):
    climb = Start.drawn(seed, (0.05, 0.08, 0.12, 0.16)).climb(6.0)
    print(f"{climb.fastest():.2f} m/s, {climb.fastest_turn():.2f} rad/s, {climb.controller.mode}")
    assert climb.fastest() < 1.0
    assert climb.fastest_turn() < 6.0
