"""Steps of a climber whose contacts stick and slip in any direction: implicit, gaining no energy.

    ν⁺ = ν + M⁻¹ (h Q + Σ Hᵢ λᵢ),   λᵢ opposes Hᵢᵀ ν⁺,  |λᵢ| <= h cᵢ

Implicit Euler on the friction cones (Moreau 1988; here their loads are known, so that ν⁺ is the
minimum of a convex function and unique). ν = (v, u, ω, ρR, ρL): forward, to the left, yaw rate, and
the speed of each wheel's rim. Contacts: two wheels, the ring of the seal, tracks that scrub. First
order in the step, against four while nothing changes; so steps are short, and taken only here.
"""

import math
from functools import cached_property, lru_cache

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.simulation.cones import Cone, solve_friction_impulses
from climber_uk.simulation.inputs import Inputs
from climber_uk.simulation.rigid_body import RigidBody, forward_speed

PARTS, PARTS_SCRUBBING = 8, 1  # of a step; where wheels scrub, the motion is smooth
STUCK = 1e-10  # [m/s] of sliding that the iteration may leave where a contact sticks


class ContactStepper:
    """Steps of a rigid body; wheels slip, if `slip`, where their load does not suffice.

    (11) and (15) count the inertia of rolling wheels into m and J; where wheels slip it is taken
    out again. Raises `ValueError` if it is not less than m and J.
    """

    def __init__(self, body: RigidBody, slip: bool) -> None:
        self.body, self.slip = body, slip
        if self.slip and min(self.mass, self.yaw_inertia) <= 0:
            inertia = self.body.contact.grip.wheel_inertia
            raise ValueError(
                f"wheel_inertia={inertia!r} must be < what mass and yaw_inertia count it into"
            )

    @cached_property
    def rim(self) -> float:
        """Inertia of what turns with a wheel over r², as a mass at its rim [kg]."""
        climber = self.body.climber
        inertia = self.body.contact.grip.wheel_inertia + climber.rotor_inertia
        return inertia / climber.wheel_radius**2

    @cached_property
    def mass(self) -> float:
        """Mass [kg] without the wheels' inertia."""
        return self.body.climber.driven_mass - 2 * self.rim * self.slip

    @cached_property
    def yaw_inertia(self) -> float:
        """Yaw inertia [kg m²] without the wheels' inertia."""
        climber = self.body.climber
        return climber.driven_inertia - 2 * self.rim * climber.half_track**2 * self.slip

    def wheels_stick(
        self, y: Array, inputs: Inputs, accelerations: tuple[float, float], load: float
    ) -> bool:
        """Whether wheels that share `load` [N] can go on rolling, with v̇ [m/s²] and ω̇ [rad/s²]."""
        d, (v_1, omega_1) = self.body.climber.half_track, accelerations
        contact, across = self.body.contact, self.body.across(y, inputs)
        right = (inputs.force + inputs.moment / d) / 2 - self.rim * (v_1 + d * omega_1)
        left = (inputs.force - inputs.moment / d) / 2 - self.rim * (v_1 - d * omega_1)
        sideways = 0.0
        loads = contact.wheel_loads(self.body.climber, load, across)
        for side, force in zip(loads, (right, left), strict=True):
            most = contact.grip.wheel_friction_coefficient * side
            if abs(force) > most:
                return False
            sideways += math.sqrt(most**2 - force**2)
        return abs(self.body.lateral(y, inputs, self.mass)) <= sideways

    def advance(self, y: Array, slip: Array, inputs: Inputs, load: float) -> tuple[Array, Array]:
        """(y, slip (2,) of the rims [m/s]) after a step, with `load` [N] on the wheels."""
        caught, parts = False, PARTS_SCRUBBING if self.scrubs else PARTS
        for _ in range(parts):
            before = y
            y, slip, caught = self._implicit_step(y, slip, inputs, load, self.body.step / parts)
            if caught and (y == before).all():
                break  # at rest, and nothing will change that in this step
        return self._rolling_on(y, slip) if caught else (y, slip)

    def _implicit_step(
        self, y: Array, slip: Array, inputs: Inputs, load: float, h: float
    ) -> tuple[Array, Array, bool]:
        """(y, slip of the rims) after `h` [s], and whether no wheel slips any more."""
        d = self.body.climber.half_track
        x, height, heading, v_x, v_y, omega, *deflection = y.tolist()
        middle = heading + h / 2 * omega if self.slip else heading
        cosine, sine = math.cos(middle), math.sin(middle)
        v, rolls = v_x * cosine + v_y * sine, forward_speed(y)
        u = v_y * cosine - v_x * sine if self.slip else 0.0
        before = np.array([v, u, omega])
        sliding = before * [1.0, 1.0, self._radius]

        f_x, f_y = self.body.outside(x, height, inputs)
        pull = np.array([f_x * cosine + f_y * sine, f_y * cosine - f_x * sine, inputs.push_moment])
        against, drag = self._smooth_friction(sliding, np.array(deflection), h)
        masses = np.array([self.mass, self.mass, self.yaw_inertia])
        free = masses * before + h * (pull - against)
        if self.slip:
            yaw_force = inputs.moment / d
            forces = np.array([inputs.force + yaw_force, inputs.force - yaw_force]) / 2
            rims = slip + np.array([rolls + d * omega, rolls - d * omega])
            free = np.concatenate([free, self.rim * rims + h * forces])
            before = np.concatenate([before, rims])
            masses = np.concatenate([masses + h * drag, [self.rim, self.rim]])
            lightness = 1 / masses
        else:
            free += h * np.array([inputs.force, 0.0, inputs.moment])
            lightness = 1 / (masses + h * drag)
            free[1] = lightness[1] = 0.0
        cones = self._wheel_cones(h * load, h * pull, lightness) if self.slip else []
        cones += self._other_cones(load, float(np.linalg.norm(sliding)), h)
        velocities, sticks = solve_friction_impulses(free * lightness, lightness, cones, before)
        v, u, omega = self._velocities(velocities[:3], sticks)

        deflection_1 = self._deflected(
            sliding, np.array([v, u, omega * self._radius]), np.array(deflection), h
        )
        x, height = x + h * (v * cosine - u * sine), height + h * (v * sine + u * cosine)
        heading += h * omega
        if not self.slip:
            cosine, sine = math.cos(heading), math.sin(heading)
        v_x, v_y = v * cosine - u * sine, v * sine + u * cosine
        end = np.array([x, height, heading, v_x, v_y, omega, *deflection_1])
        if not self.slip:
            return end, slip, False
        rolls = forward_speed(end)
        feet = 2 * len(self.body.contact.locomotion.footholds)
        caught = max(abs(s) for cone in cones[:feet] for s in cone.rows @ velocities) < STUCK
        if caught and rolls == omega == 0:
            return end, np.zeros(2), True
        return end, velocities[3:] - [rolls + d * omega, rolls - d * omega], caught

    @property
    def _radius(self) -> float:
        return self.body.contact.grip.seal_radius

    @property
    def _drag(self) -> float:
        """Part of friction with an edge that goes with the speed [N s/m]."""
        return float(self.body.contact.friction.drag(self.body.friction))

    def _other_cones(self, load: float, sliding: float, h: float) -> list[Cone]:
        """Cones of the seal, and of what scrubs while wheels do not slip."""
        contact, n = self.body.contact, 5 if self.slip else 3
        cones = []
        if contact.friction.stiction(1.0) > 0:
            rows = np.eye(3, n)
            rows[2, 2] = self._radius
            level = float(contact.friction.level(self.body.friction, sliding))
            level -= self._drag * sliding  # which is implicit
            cones.append(Cone(rows, h * level))
        else:
            cones.append(Cone(np.eye(1, n), 0.0))
        scrubs_here = self.slip and self.scrubs  # then the wheels' cones have it
        resistance = 0.0 if scrubs_here else float(contact.locomotion.turning_resistance(load))
        cones.append(Cone(np.eye(1, n, 2), h * resistance))
        return cones

    @property
    def scrubs(self) -> bool:
        """Whether wheels stand ahead of or behind the axle."""
        return any(self.body.contact.locomotion.footholds)

    def _wheel_cones(self, load: float, pull: Array, lightness: Array) -> list[Cone]:
        """Cones of the wheels under `load` [N s]; a side's wheels share one rim.

        `pull` (3,) [N s] acts on the centre of mass: forward, to the left, about the vertical.
        """
        contact, climber = self.body.contact, self.body.climber
        ahead, cones, d = contact.locomotion.footholds, list[Cone](), climber.half_track
        along_pull, across_pull, _ = pull.tolist()
        # what pulls forward loads what stands ahead
        pitch = along_pull * contact.grip.centre_height / 2 / (sum(x * x for x in ahead) or 1.0)
        sides = contact.wheel_loads(climber, load, across_pull)
        along = contact.grip.wheel_friction_coefficient
        across = 1.0  # friction to a side, as a share of that along
        if self.scrubs and along > 0:
            across = contact.locomotion.scrub_friction_coefficient / along
        for side, rim, side_load in ((d, 3, sides[0]), (-d, 4, sides[1])):
            for x in ahead:
                foot_load = max(0.0, side_load / len(ahead) + pitch * x)
                rows = _foot_rows(side, rim, x, across, *lightness.tolist())
                cones.append(Cone(rows, along * foot_load))
        return cones

    def _velocities(self, velocities: Array, sticks: list[bool]) -> tuple[float, float, float]:
        """(v, u, ω) of `velocities` (n,), exactly 0 where a contact sticks."""
        v, u, omega = velocities.tolist()
        *wheels_stick, seal_sticks, yaw_sticks = sticks
        if self.slip and self.scrubs:
            yaw_sticks = all(wheels_stick)
        if seal_sticks and math.hypot(v, u, self._radius * omega) < STUCK:
            v, u, omega = 0.0, 0.0, 0.0 if self._radius > 0 else omega
        return v, u, 0.0 if yaw_sticks and abs(omega) < STUCK else omega

    # Friction without stiction: a + D s⁺ against the sliding s⁺ = (v, u, R ω) after h

    def _smooth_friction(self, sliding: Array, deflection: Array, h: float) -> tuple[Array, Array]:
        """Force (3,) that is there already [N, N, N m], and drag (3,) [N s/m, N s/m, N m s]."""
        law, bristles, f = self.body.contact.friction, self.body.bristles, self.body.friction
        lever = np.array([1.0, 1.0, self._radius])
        speed = float(np.linalg.norm(sliding))
        if bristles is not None:
            q, T = 1 + h * bristles.relaxation(speed), bristles.damping_time
            stiffness = bristles.stiffness(f)
            there = stiffness * (deflection / q + T * (deflection / q - deflection) / h)
            drag = stiffness * (h + T) / q + bristles.drag(f)
            return lever * there, lever**2 * drag
        if law.stiction(1.0) > 0:
            return np.zeros(3), lever**2 * self._drag
        slope = law.level(f, speed) / speed if speed > 0 else law.steepness(f)
        return np.zeros(3), lever**2 * slope

    def _deflected(self, before: Array, after: Array, deflection: Array, h: float) -> Array:
        """Bristles after `h`, in which they slid at `before` (3,), and at last `after` (3,)."""
        bristles = self.body.bristles
        if bristles is None:
            return deflection
        return (deflection + h * after) / (
            1 + h * bristles.relaxation(float(np.linalg.norm(before)))
        )

    def _rolling_on(self, y: Array, slip: Array) -> tuple[Array, Array]:
        """(y, no slip) of wheels that roll again: the momentum of rims and climber is kept."""
        climber, d = self.body.climber, self.body.climber.half_track
        v = forward_speed(y) + self.rim * float(slip.sum()) / climber.driven_mass
        omega = float(y[5]) + self.rim * d * float(slip[0] - slip[1]) / climber.driven_inertia
        heading, end = float(y[2]), y.copy()
        end[3:6] = v * math.cos(heading), v * math.sin(heading), omega
        return end, np.zeros(2)


@lru_cache(maxsize=64)
def _foot_rows(side: float, rim: int, x: float, across: float, *lightness: float) -> Array:
    """H (2, 5) of a wheel `x` [m] ahead of the axle, such that H M⁻¹ Hᵀ is diagonal."""
    rows = np.zeros((2, 5))
    rows[0, [0, 2, rim]] = 1.0, side, -1.0
    rows[1, [1, 2]] = across, across * x
    if x != 0:
        _, axes = np.linalg.eigh(rows * lightness @ rows.T)
        rows = axes.T @ rows
    return rows
