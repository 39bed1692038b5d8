"""Friction impulses on cones of known size, each against the sliding of its contact.

    ν⁺ = ν + M⁻¹ Σ Hᵢᵀ λᵢ,   |λᵢ| <= Lᵢ,   λᵢ = -Lᵢ sᵢ/|sᵢ| where sᵢ = Hᵢ ν⁺ is not 0

ν⁺ minimises ½ (ν⁺ - ν)ᵀ M (ν⁺ - ν) + Σ Lᵢ |sᵢ|: it is unique, and has no more energy than ν. It is
found contact by contact until nothing changes (block Gauss-Seidel), each contact exactly.
"""

import math
from typing import NamedTuple

import numpy as np

from climber_uk.mechanics import Array

MAX_SWEEPS = 5000  # a few suffice, unless contacts only just hold each other
UNCHANGED = 1e-13  # of the speeds there are, and of 1 m/s
SMALLEST = 1e-90  # [N s] of an impulse, below which it counts as 0: its cube still is a number


class Cone(NamedTuple):
    """A contact: sliding s = H ν of k components, with H M⁻¹ Hᵀ diagonal, and its limit."""

    rows: Array  # H (k, n)
    limit: float  # L of the impulse [N s]


def solve_friction_impulses(
    velocity: Array, lightness: Array, cones: list[Cone]
) -> tuple[Array, list[bool]]:
    """ν⁺ (n,) from ν = `velocity` (n,) and `lightness`, the diagonal (n,) of M⁻¹.

    And for each cone whether its contact sticks.
    """
    velocity = velocity.copy()
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
    sticks = [
        bool(impulse @ impulse < (1 - 1e-9) * cone.limit**2)
        for impulse, cone in zip(impulses, cones, strict=True)
    ]
    return velocity, sticks


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
