"""Experiments with the plant that have an answer of their own: what `bench/plant.py` draws.

A block of 1 kg on a floor that rubs with 1 N, as Canudas de Wit et al. (1995) have it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import Friction, LuGre, Stribeck
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.plant import Plant

BLOCK = Climber(
    mass=1.0,
    seal_friction_coefficient=1.0,
    wheel_load_share=0.0,
    suction_pressure=1.0,
    suction_area=1.0,
    inclination=0.0,
)
# σ₀ = 1e5 N/m, σ₁ = √1e5 N s/m, σ₂ = 0.4 N s/m, F_c = 1 N, F_s = 1.5 N, v_s = 0.001 m/s
PUBLISHED = LuGre(ratio=1.5, speed=1e-3, viscous=0.4, deflection=1e-5, damping_time=1e5**-0.5)
EDGED = Stribeck(ratio=1.5, speed=1e-3)  # the same without bristles, nor drag
NO_TORQUE = np.zeros(2)
AT_REST = State(np.zeros(3), np.zeros(3))


@dataclass(frozen=True)
class Motion:
    """A block's way, at n times."""

    time: Array  # (n,) [s]
    x: Array  # (n,) [m]
    v: Array  # (n,) [m/s]
    force: Array  # (n,) that pulls [N]


def pulled(
    law: Friction, force: Callable[[float, float], float], duration: float, step: float = 1e-3
) -> Motion:
    """Motion of the block under `force` of time [s] and x [m], taken in the middle of a step."""
    plant, state, rows = Plant(BLOCK, step, Contact(friction=law)), AT_REST, []
    for number in range(round(duration / step)):
        time, (x, *_), v = number * step, state.pose.tolist(), float(state.forward_speed)
        rows.append([time, x, v, force(time, x)])
        middle = force(time + step / 2, x + v * step / 2)
        state = plant.advance(state, NO_TORQUE, 1, np.array([middle, 0.0, 0.0]))
    return Motion(*np.array(rows).T)


def published(force: Callable[[float, float], float], duration: float, times: Array) -> Motion:
    """The same by the published equations as they stand, integrated by Radau's method."""
    sigma_0, sigma_1, sigma_2, F_c, F_s, v_s = 1e5, 1e5**0.5, 0.4, 1.0, 1.5, 1e-3

    def rates(time: float, y: Array) -> list[float]:
        x, v, z = y
        g = F_c + (F_s - F_c) * np.exp(-((v / v_s) ** 2))
        z_1 = v - sigma_0 * abs(v) * z / g
        return [v, force(time, x) - sigma_0 * z - sigma_1 * z_1 - sigma_2 * v, z_1]

    x, v, _ = solve_ivp(
        *(rates, (0.0, duration), [0.0, 0.0, 0.0], "Radau"),
        t_eval=times,
        rtol=1e-7,
        atol=1e-10,
    ).y
    pull = [force(time, at) for time, at in zip(times.tolist(), x.tolist(), strict=True)]
    return Motion(times, x, v, np.array(pull))


def spring(stiffness: float = 2.0, speed: float = 0.1) -> Callable[[float, float], float]:
    """Force of a spring [N/m] whose other end moves on at `speed` [m/s]."""
    return lambda time, x: stiffness * (speed * time - x)


def swinging(most: float = 1.425, period: float = 4.0) -> Callable[[float, float], float]:
    """Force that goes up to `most` [N], down to as much the other way, and up again."""
    return lambda time, x: most * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * time / period))


def stick_slip_period(stiffness: float = 2.0, speed: float = 0.1) -> float:
    """Period [s] of 1 kg that sticks up to 1.5 N and slides at 1 N, pulled by a spring.

    It sticks while the spring gains 2 (F_s - F_c), and slides for the rest of a swing about F_c.
    """
    surplus, omega = 0.5, np.sqrt(stiffness)
    sticking = 2 * surplus / (stiffness * speed)
    sliding = 2 * (np.pi - np.arctan(omega * surplus / (stiffness * speed))) / omega
    return float(sticking + sliding)


def found_period(motion: Motion) -> float:
    """Mean time [s] between the begins of sliding, but for the first."""
    slides = motion.v > 0.05
    begins = motion.time[1:][slides[1:] & ~slides[:-1]]
    return float(np.mean(np.diff(begins[1:])))


def friction_at(law: Friction, speed: float, step: float = 1e-3) -> float:
    """Force [N] that the plant's block feels once it has slid at `speed` [m/s] for long."""
    plant = Plant(BLOCK, step, Contact(friction=law))
    state = State(np.zeros(3), np.array([speed, 0.0, 0.0]))
    lengths = 20 * law.deflection if isinstance(law, LuGre) else 0.0  # e^-20 from the start
    for _ in range(1 + round(lengths / speed / step)):
        slowed = plant.advance(state, NO_TORQUE, 1)
        force = float(speed - slowed.forward_speed) / step
        state = replace(slowed, pose=np.zeros(3), velocity=np.array([speed, 0.0, 0.0]))
    return force


def errors_by_step(
    plant: Callable[[float], Plant], start: State, torques: Array, duration: float, parts: list[int]
) -> Array:
    """Largest error of the pose, for each number of steps, against 16 times as many."""

    def end(steps: int) -> Array:
        return plant(duration / steps).advance(start, torques, steps).pose

    exact = end(16 * max(parts))
    return np.array([np.abs(end(steps) - exact).max() for steps in parts])
