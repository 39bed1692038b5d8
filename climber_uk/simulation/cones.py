"""Friction impulses on cones of known size, each against the sliding of its contact.

    ν⁺ = ν + M⁻¹ Σ Hᵢᵀ λᵢ,   |λᵢ| <= Lᵢ,   λᵢ = -Lᵢ sᵢ/|sᵢ| where sᵢ = Hᵢ ν⁺ is not 0

ν⁺ minimises ½ (ν⁺ - ν)ᵀ M (ν⁺ - ν) + Σ Lᵢ |sᵢ|: it is unique, and has no more energy than ν. It is
found contact by contact until nothing changes (block Gauss-Seidel), each contact exactly. Contacts
that hinder each other, as many on one body do, are left to Newton's method.
"""

import math
from typing import NamedTuple

import numpy as np

from climber_uk.mechanics import Array

MAX_SWEEPS = 1000  # some ten suffice, unless contacts only just hold each other
UNCHANGED = 1e-13  # of the speeds there are, and of 1 m/s
FEW = 4  # contacts, for which sweeps alone are faster
EPSILONS = 1e-3, 1e-6, 1e-9, 1e-12  # [m/s] of sliding, below which friction is taken for viscous
FROM_START = 1e-4, 1e-8, 1e-12  # from a guess that is near
STICKING = 100.0  # times the smallest of these
MAX_STEPS = 40  # of Newton's method, with each of these
FEW_STEPS = 5  # with the smallest at once, which take 3 as a rule
SMALLEST = 1e-90  # [N s] of an impulse, below which it counts as 0: its cube still is a number


class Cone(NamedTuple):
    """A contact: sliding s = H ν of k components, with H M⁻¹ Hᵀ diagonal, and its limit."""

    rows: Array  # H (k, n)
    limit: float  # L of the impulse [N s]


def solve_friction_impulses(
    velocity: Array, lightness: Array, cones: list[Cone], start: Array
) -> tuple[Array, list[bool]]:
    """ν⁺ (n,) from ν = `velocity` (n,) and `lightness`, the diagonal (n,) of M⁻¹.

    And for each cone whether its contact sticks. `start` (n,) is a guess of ν⁺, as that of
    the step before; it decides how soon ν⁺ is found, not what it is.
    """
    all_move = bool(lightness.all())
    if len(cones) > FEW and all_move:
        found = _by_newton(velocity, 1 / lightness, cones, start)
        if found is not None:
            return found
    before, velocity = velocity, velocity.copy()
    impulses: list[Array] = [np.zeros(len(cone.rows)) for cone in cones]
    per_impulse = [lightness[:, None] * cone.rows.T for cone in cones]  # M⁻¹ Hᵀ
    yielding = [(cone.rows**2) @ lightness for cone in cones]
    moving = [np.where(W > 0, W, 1.0) for W in yielding]  # what cannot move does not slide
    enough = UNCHANGED * (1 + np.abs(velocity).max())
    for _ in range(MAX_SWEEPS):
        changed = 0.0
        for number, cone in enumerate(cones):
            without = cone.rows @ velocity - yielding[number] * impulses[number]
            impulse = impulse_against(without, moving[number], cone.limit)
            change = per_impulse[number] @ (impulse - impulses[number])
            velocity += change
            impulses[number] = impulse
            changed = max(changed, *map(abs, change.tolist()))
        if changed <= enough:
            break
    else:
        found = _by_newton(before, 1 / lightness, cones, velocity) if all_move else None
        if found is not None:
            return found
    sticks = [
        bool(impulse @ impulse < (1 - 1e-9) * cone.limit**2)
        for impulse, cone in zip(impulses, cones, strict=True)
    ]
    return velocity, sticks


def _by_newton(
    velocity: Array, masses: Array, cones: list[Cone], start: Array
) -> tuple[Array, list[bool]] | None:
    """The same, with √(s² + ε²) in the place of |s|; None: not found.

    With the smallest ε at once from `start`, where contacts stick or slide as they did; else with
    one after the other of `FROM_START` from there, or of `EPSILONS` from rest. The directions
    w = s/√(s² + ε²) are unknowns of their own beside ν (Chan, Golub & Mulet 1999): so it takes few
    steps where contacts stick, too.
    """
    limits = np.array([cone.limit for cone in cones])
    rows = np.zeros((len(cones), max(len(cone.rows) for cone in cones), len(velocity)))
    for number, cone in enumerate(cones):
        rows[number, : len(cone.rows)] = cone.rows
    problem = velocity, np.diag(masses), limits, rows
    sliding = rows @ start
    squares = (sliding**2).sum(axis=1)
    rest = velocity, np.zeros(rows.shape[:2])
    for epsilons, begin, steps in (
        (EPSILONS[-1:], EPSILONS[1], FEW_STEPS),
        (FROM_START, FROM_START[0], MAX_STEPS),
        (EPSILONS, None, MAX_STEPS),
    ):
        found: tuple[Array, Array] | None = rest
        if begin is not None:
            found = start, sliding / np.sqrt(squares + begin**2)[:, None]
        for epsilon in epsilons:
            found = found and _newton(*problem, epsilon, found, steps)
        if found is not None:
            sliding = rows @ found[0]
            sticks = np.sqrt((sliding**2).sum(axis=1)) < STICKING * EPSILONS[-1]
            return found[0], sticks.tolist()
    return None


def _newton(
    velocity: Array,
    masses: Array,
    limits: Array,
    rows: Array,
    epsilon: float,
    begin: tuple[Array, Array],
    max_steps: int,
) -> tuple[Array, Array] | None:
    """ν⁺ (n,) and directions (contacts, k) for one ε, from such a pair to begin with."""
    found, directions = begin
    contacts, k, n = rows.shape
    flat = rows.reshape(-1, n)
    summed = np.repeat(np.eye(contacts), k, axis=1)  # of all components of each contact
    for _ in range(max_steps):
        s = flat @ found
        size = np.sqrt(summed @ (s * s) + epsilon * epsilon)
        pull = limits / size  # impulse per sliding
        each = np.repeat(pull, k)[:, None] * flat
        turned = summed @ (s[:, None] * flat)
        held = summed @ (directions.reshape(-1, 1) * each) / size[:, None]
        both = turned.T @ held
        curvature = masses + flat.T @ each - (both + both.T) / 2
        step = np.linalg.solve(curvature, masses @ (velocity - found) - s @ each)
        slid = flat @ step
        along = summed @ (s * slid) / size
        found = found + step
        directions = (s + slid).reshape(contacts, k) - directions * along[:, None]
        directions /= size[:, None]
        length = np.sqrt(summed @ directions.ravel() ** 2)
        directions /= np.maximum(1.0, length)[:, None]
        if np.abs(step).max() <= UNCHANGED + epsilon / 1e6:
            return found, directions
    return None


def impulse_against(sliding: Array, W: Array, limit: float) -> Array:
    """Impulse λ (k,), |λ| <= `limit`, that stops a contact's `sliding` s (k,) or opposes the rest.

    The rest is s + W λ, with the diagonal `W` (k,) of speed per impulse, > 0.
    λ = -s / (W + κ), with κ >= 0 such that |λ| is the limit, by Newton's method on 1/|λ|, which
    comes up to κ from below.
    """
    if limit < SMALLEST:
        return 0.0 * sliding
    kappa, impulse = 0.0, -sliding / W
    size = math.sqrt(impulse @ impulse)
    if size <= limit:
        return impulse
    for _ in range(60):
        slope = float(impulse @ (impulse / (W + kappa)))
        kappa += size**2 / slope * (size - limit) / limit
        impulse = -sliding / (W + kappa)
        size = math.sqrt(impulse @ impulse)
        if size <= limit * (1 + 1e-14):
            break
    return impulse * (limit / size)
