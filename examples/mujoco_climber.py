"""A climber in MuJoCo, made from the parameters of plant_simulator: `pip install mujoco`.

A free body on wheels with contact friction. The adhesion presses its wheels onto the wall; of a
suction, pads carry the seal's share and rub. Two wheels have skids without friction ahead and
behind; of four, a belt couples front and rear. Gravity pulls as `inclination` says.

On a round wall, whatever touches it has a plane of its own, which is kept tangent to the wall
under it (`mujoco_wall`). Poses are those on the wall unrolled, as the plant's.

It stands in the place of a `SimulatedRobot`, with motors and sensors that are the plant's.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np
from mujoco_wall import Flat, Surface, surface

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import DEGREE, GRAVITY
from climber_uk.mechanics.contact import FourWheeled, Wheeled
from climber_uk.mechanics.friction import Coulomb
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.wall import Plane
from climber_uk.simulation.inputs import FellOff
from climber_uk.simulation.sensors import Odometer
from climber_uk.simulation.simulated_robot import UNPUSHED, Parts, Push

LONGEST_STEP = 1e-3  # [s] of the engine
TYRE, PAD = "0.03 1", "0.01 1"  # time constant [s] and damping ratio of what they stand on
WHEEL_MASS, PAD_MASS = 0.01, 0.006  # of the climber's, each
RIM_WIDTH, SKID, PAD_SIZE = 0.01, 0.01, 0.005  # [m]
CLEARANCE = 3e-4  # [m] of a skid over the wall
SETTLING = 0.5  # [s] until tyres and pads bear their loads
LIFTED = 0.02  # [m] off the wall: the climber has fallen
SEEN = 8  # [m] of the wall in pictures, each way
INSTANT = 1e-5  # [s] for what is differentiated

SIDES = 1, -1  # left and right: the sign of y
NAMES = {1: "left", -1: "right"}


@dataclass(frozen=True)
class Model:
    """MJCF of a climber; raises `ValueError` where the engine has not what the parts ask for."""

    parts: Parts

    def __post_init__(self) -> None:
        plant, contact = self.parts.plant, self.parts.plant.contact
        for name, chosen, known in (
            ("friction", contact.friction, Coulomb),
            ("locomotion", contact.locomotion, Wheeled | FourWheeled),
        ):
            if not isinstance(chosen, known):
                raise ValueError(f"{name}: {type(chosen).__name__} is not in this model of MuJoCo")
        if min(self.body_mass, self.body_inertia) <= 0:
            raise ValueError(
                f"yaw_inertia={plant.climber.yaw_inertia!r} and mass={plant.climber.mass!r} must "
                "be more than those of wheels, rims and pads"
            )

    @property
    def footholds(self) -> tuple[float, ...]:
        """Where each side's wheels stand, ahead of the centre, front to rear [m]."""
        return tuple(self.parts.plant.contact.locomotion.footholds)

    @property
    def wheels(self) -> dict[str, tuple[float, float]]:
        """Places (x, y) [m] of the wheels, by name."""
        d = self.parts.plant.climber.half_track
        return {
            f"{NAMES[side]}_{number}": (x, side * d)
            for side, (number, x) in product(SIDES, enumerate(self.footholds))
        }

    @property
    def pads(self) -> list[tuple[float, float]]:
        """Places (x, y) [m] of what stands for the seal: a ring, or a point."""
        contact = self.parts.plant.contact
        radius, seal = contact.grip.seal_radius, contact.seal_friction(self.parts.plant.climber)
        if seal == 0:
            return []
        if radius == 0:
            return [(0.0, 0.0)]
        angles = [number * math.pi / 2 for number in range(4)]
        return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]

    @property
    def rim(self) -> float:
        """Inertia of a side's wheels over r² [kg], which the climber's mass contains."""
        plant = self.parts.plant
        return plant.contact.grip.wheel_inertia / plant.climber.wheel_radius**2

    @property
    def body_mass(self) -> float:
        """Mass [kg] of the body without wheels and pads."""
        share = 1 - WHEEL_MASS * len(self.wheels) - PAD_MASS * len(self.pads)
        return self.parts.plant.climber.mass * share - 2 * self.rim

    @property
    def body_inertia(self) -> float:
        """The body's part of the yaw inertia [kg m²]."""
        climber = self.parts.plant.climber
        inertia = climber.yaw_inertia - 2 * self.rim * climber.half_track**2
        for share, places in ((WHEEL_MASS, self.wheels.values()), (PAD_MASS, self.pads)):
            inertia -= share * climber.mass * sum(x * x + y * y for x, y in places)
        return inertia

    @property
    def surface(self) -> Surface:
        """The wall in space."""
        return surface(self.parts.plant.wall, self.parts.plant.climber.inclination)

    def mjcf(self, radius: float, on: Surface) -> str:
        """The model `on` a surface, with tyres of a `radius` [m] without load."""
        climber, grip = self.parts.plant.climber, self.parts.plant.contact.grip
        parts = [*self.tyres(radius), *self.seal(), *self.skids(on)]
        height = (grip.centre_height - climber.wheel_radius) * climber.mass / self.body_mass
        tilting = self.body_mass * (grip.wheelbase**2 + 4 * climber.half_track**2) / 12
        return f"""<mujoco>
  <option integrator="implicitfast" cone="elliptic" impratio="100" tolerance="1e-10"/>
  <compiler balanceinertia="true"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <visual><headlight ambient="0.5 0.5 0.5"/></visual>
  <asset>
    <texture name="squares" type="2d" builtin="checker" width="64" height="64"
      rgb1="0.8 0.8 0.75" rgb2="0.7 0.7 0.65"/>
    <material name="squares" texture="squares"/>
    {_seen(on)}
  </asset>
  <worldbody>
    <geom type="mesh" mesh="wall" material="squares"/>
    {"".join(wall for *_, wall in parts)}
    <body name="climber" pos="0 0 {climber.wheel_radius}">
      <freejoint/>
      <inertial pos="0 0 {height}" mass="{self.body_mass}"
        diaginertia="{tilting} {tilting} {self.body_inertia}"/>
      <geom type="box" size="{grip.wheelbase / 2} {climber.half_track * 0.8} 0.01"
        pos="0 0 0.03" rgba="0.2 0.4 0.7 1"/>
      {"".join(body for body, *_ in parts)}
    </body>
  </worldbody>
  <contact>{"".join(contact for _, contact, _ in parts)}</contact>
  <equality>{"".join(self.belts())}</equality>
</mujoco>"""

    def tyres(self, radius: float) -> Iterator[tuple[str, str, str]]:
        """Wheels, their contacts, and what they stand on."""
        climber, grip = self.parts.plant.climber, self.parts.plant.contact.grip
        spin = (grip.wheel_inertia + climber.rotor_inertia) / len(self.footholds)
        mu = grip.wheel_friction_coefficient
        for name, (x, y) in self.wheels.items():
            body = (
                f'<body name="{name}" pos="{x} {y} 0"><joint name="{name}" axis="0 1 0"/>'
                f'<inertial pos="0 0 0" mass="{WHEEL_MASS * climber.mass}"'
                f' diaginertia="{spin} {spin} {spin}"/><geom name="{name}" type="cylinder"'
                f' size="{radius} {RIM_WIDTH / 2}" euler="90 0 0"/></body>'
            )
            yield body, *_standing(name, f'condim="4" friction="{mu} {mu} 1e-3 0 0"', TYRE)

    def seal(self) -> Iterator[tuple[str, str, str]]:
        """Pads that are pressed onto the wall: as `tyres`."""
        climber = self.parts.plant.climber
        mu = climber.seal_friction_coefficient
        for number, (x, y) in enumerate(self.pads):
            name = f"pad{number}"
            body = (
                f'<body name="{name}" pos="{x} {y} {PAD_SIZE - climber.wheel_radius}">'
                f'<joint name="{name}" type="slide" axis="0 0 1" damping="50"/><geom name="{name}"'
                f' type="sphere" size="{PAD_SIZE}" mass="{PAD_MASS * climber.mass}"/></body>'
            )
            yield body, *_standing(name, f'condim="3" friction="{mu} {mu} 0 0 0"', PAD)

    def skids(self, on: Surface) -> Iterator[tuple[str, str, str]]:
        """What keeps two wheels from tipping, without friction: as `tyres`.

        They clear the wall between the wheels wherever it heads.
        """
        climber, reach = self.parts.plant.climber, self.parts.plant.contact.grip.wheelbase / 2
        angles = np.arange(0, math.pi, math.pi / 16)
        ahead = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        (at_skids, _), (at_wheels, _) = (
            on.at(way) for way in (reach * ahead, climber.half_track * ahead[:, ::-1] * [-1, 1])
        )
        proud = max(0.0, float((at_skids - at_wheels)[:, 2].max()))
        z = SKID + CLEARANCE + proud - climber.wheel_radius
        for side in SIDES if len(self.footholds) == 1 else ():
            name = f"skid{side}"
            body = f'<geom name="{name}" type="sphere" size="{SKID}" pos="{side * reach} 0 {z}"/>'
            yield body, *_standing(name, 'condim="1"', TYRE)

    def belts(self) -> Iterator[str]:
        """What turns the wheels of a side together."""
        for name, number in product(NAMES.values(), range(1, len(self.footholds))):
            yield (
                f'<joint joint1="{name}_0" joint2="{name}_{number}" polycoef="0 1 0 0 0"'
                ' solref="0.002 1"/>'
            )


def _seen(wall: Surface) -> str:
    """A mesh of a wall, for pictures, with a texture every metre."""
    ticks = np.linspace(-SEEN, SEEN, 4 * SEEN + 1)
    places = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    points, _ = wall.at(places)
    corner = np.arange(len(places)).reshape(len(ticks), -1)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    arrays = {"vertex": points, "texcoord": places, "face": np.stack([a, b, c, a, c, d], axis=-1)}
    said = (f'{name}="{" ".join(map(str, of.ravel()))}"' for name, of in arrays.items())
    return f'<mesh name="wall" inertia="shell" {" ".join(said)}/>'


def _standing(name: str, friction: str, softness: str) -> tuple[str, str]:
    """A contact, and the plane that it is on."""
    contact = f'<pair geom1="under_{name}" geom2="{name}" {friction} solref="{softness}"/>'
    plane = f'<geom name="under_{name}" type="plane" size="1 1 1" rgba="0 0 0 0"/>'
    return contact, f'<body name="under_{name}" mocap="true">{plane}</body>'


class MujocoClimber:
    """State of the engine, motors and sensors: see `SimulatedRobot`, in whose place it stands."""

    def __init__(self, parts: Parts, start: State, period: float) -> None:
        self.parts, self.plant = parts, parts.plant
        self.model_of = Model(parts)
        self.substeps = math.ceil(self.plant.step / LONGEST_STEP - 1e-9)
        radius = self.plant.climber.wheel_radius
        self.load(radius, Flat())
        self.settle(State.rolling(np.zeros(3), 0.0, 0.0))
        # a tyre that is pressed in by p rolls as one of its radius less p/2
        self.load(radius + (radius - self.height) / 2, self.model_of.surface)
        self.settle(start)
        self.start_moving(start)
        self.torques: Array = np.zeros(2)  # [N m] at the wheels: right, left
        self.rates = self.rates_before = self.turning()
        self.state = start
        self.odometer = Odometer(parts.sensors, self.plant.climber, period, start, parts.source)

    # The model

    def load(self, radius: float, on: Surface) -> None:
        """Make the engine's model `on` a surface, with tyres of that `radius` [m]."""
        model = mujoco.MjModel.from_xml_string(self.model_of.mjcf(radius, on))
        model.opt.timestep = self.plant.step / self.substeps
        self.model, self.data, self.surface = model, mujoco.MjData(model), on
        self.joints = [  # of the right and the left wheels, front to rear
            [n for n in self.model_of.wheels if n.startswith(NAMES[side])] for side in (-1, 1)
        ]
        self.places = [[model.joint(n).qposadr[0] for n in names] for names in self.joints]
        self.speeds = [[model.joint(n).dofadr[0] for n in names] for names in self.joints]
        self.body = model.body("climber").id
        self.wheels = [model.body(n).id for n in self.model_of.wheels]
        # what stands on planes, wheels first
        self.standing = [model.geom(n).id for n in _geoms(model) if f"under_{n}" in _geoms(model)]

    def settle(self, start: State) -> None:
        """Let tyres and pads bear what presses them at a start, without any pull along the wall."""
        radius = self.plant.climber.wheel_radius
        self.data.qpos[:7] = self.posed(start.pose, radius)
        mujoco.mj_kinematics(self.model, self.data)
        self.lay()
        _, [frame] = self.surface.at(start.pose[None, :2])
        off = frame[:, 2]
        gravity = self.gravity
        self.model.opt.gravity[:] = gravity @ off * off
        mujoco.mj_step(self.model, self.data, nstep=round(SETTLING / self.model.opt.timestep))
        self.model.opt.gravity[:] = gravity
        self.data.qvel[:] = 0.0
        for places in self.places:
            self.data.qpos[places] = 0.0

    @property
    def gravity(self) -> Array:
        """Gravity (3,) [m/s²]; of the climber's mass, though that contains rims: they only turn."""
        climber, wall = self.plant.climber, self.plant.wall
        tilt = wall.tilt * DEGREE if isinstance(wall, Plane) else 0.0
        steep = climber.inclination * DEGREE
        down = math.sin(steep) * math.sin(tilt), -math.sin(steep) * math.cos(tilt)
        weighed = climber.mass / (climber.mass - 2 * self.model_of.rim)
        return GRAVITY * weighed * np.array([*down, -math.cos(steep)])

    def lay(self) -> None:
        """Lay planes under what stands on them, and have it pressed onto them."""
        climber, contact = self.plant.climber, self.plant.contact
        points, frames = self.surface.at(self.surface.under(self.data.geom_xpos[self.standing]))
        self.data.mocap_pos[:] = points
        for quaternion, frame in zip(self.data.mocap_quat, frames, strict=True):
            mujoco.mju_mat2Quat(quaternion, frame.ravel())
        self.off = frames[: len(self.wheels), :, 2]
        force = contact.adhesion.force(climber)
        self.data.xfrc_applied[self.wheels, :3] = -force / len(self.wheels) * self.off
        for number, _ in enumerate(self.model_of.pads):
            dof = self.model.joint(f"pad{number}").dofadr[0]
            share = (1 - climber.wheel_load_share) / len(self.model_of.pads)
            self.data.qfrc_applied[dof] = -share * force

    def posed(self, pose: Array, height: float) -> Array:
        """Position and quaternion (7,) of a pose on the wall, at a height [m] over it."""
        points, frames = self.surface.at(pose[None, :2])
        cosine, sine = math.cos(pose[2]), math.sin(pose[2])
        turned = frames[0] @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, turned.ravel())
        return np.concatenate([points[0] + height * turned[:, 2], quaternion])

    def start_moving(self, start: State) -> None:
        """Have the settled climber move as a start does."""
        here, there, height = self.data.qpos.copy(), self.data.qpos.copy(), self.height
        here[:7], there[:7] = (
            self.posed(start.pose + time * start.velocity, height) for time in (-INSTANT, INSTANT)
        )
        mujoco.mj_differentiatePos(self.model, self.data.qvel, 2 * INSTANT, here, there)
        rates = self.plant.climber.wheel_rates(start).tolist()
        for rate, dofs in zip(rates, self.speeds, strict=True):
            self.data.qvel[dofs] = rate
        self.pose = start.pose
        mujoco.mj_forward(self.model, self.data)

    # As of a `SimulatedRobot`

    def take(self, parts: Parts) -> None:
        """Refuse: a model that runs is not changed."""
        raise ValueError("a climber in MuJoCo cannot be changed while it runs")

    def advance(self, commanded: Array, push: Push = UNPUSHED) -> None:
        """Go on by one step of the plant; raises `FellOff` where it leaves the wall."""
        climber, motors, step = self.plant.climber, self.parts.motors, self.plant.step
        wheels = self.as_wheels_tell()
        if motors.take_speeds:
            last = self.torques, self.rates_before
            self.torques = motors.servo(climber, wheels, last, commanded, step)
        else:
            self.torques = motors.torques(climber, wheels, self.torques, commanded, step)
        for torque, dofs in zip(self.torques.tolist(), self.speeds, strict=True):
            self.data.qfrc_applied[dofs] = torque / len(dofs)
        if not isinstance(self.surface, Flat):
            self.lay()
        self.data.xfrc_applied[self.body] = 0.0
        if push is not UNPUSHED:
            f_x, f_y, moment = push.on(self.state).tolist()
            _, [frame] = self.surface.at(self.state.pose[None, :2])
            pushed = frame @ np.array([[f_x, 0.0], [f_y, 0.0], [0.0, moment]])
            self.data.xfrc_applied[self.body] = pushed.T.ravel()
        mujoco.mj_step(self.model, self.data, nstep=self.substeps)
        self.rates_before, self.rates = self.rates, self.turning()
        self.state = self.told()
        if not abs(self.height - climber.wheel_radius) < LIFTED:
            raise FellOff("height of the axles", LIFTED - self.height, 0.0, "m")

    def measure(self) -> None:
        """Take an odometry of the present state; once in a period."""
        self.odometer.measure(self.state, self.as_wheels_tell(), self.angles)

    @property
    def height(self) -> float:
        """Mean height of the wheels' centres over the wall [m]."""
        over = self.data.xpos[self.wheels] - self.data.mocap_pos[: len(self.wheels)]
        return float((over * self.off).sum(axis=1).mean())

    @property
    def angles(self) -> Array:
        """Angles (2,) of the wheels [rad]: right, left."""
        return np.array([self.data.qpos[places].mean() for places in self.places])

    @property
    def pressure(self) -> float:
        """Pressure difference of the suction [Pa]."""
        return self.plant.climber.suction_pressure

    def turning(self) -> Array:
        """Rates (2,) of the wheels [rad/s]: right, left."""
        return np.array([self.data.qvel[dofs].mean() for dofs in self.speeds])

    def as_wheels_tell(self) -> State:
        """The state, rolling as its wheels rotate."""
        climber = self.plant.climber
        right, left = (climber.wheel_radius * self.rates).tolist()
        yaw_rate = (right - left) / (2 * climber.half_track)
        return State.rolling(self.state.pose, (right + left) / 2, yaw_rate)

    def told(self) -> State:
        """The state that the engine has, on the wall unrolled."""
        point, velocity = self.data.qpos[:3], self.data.qvel[:3]
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, self.data.qpos[3:7])
        axes = matrix.reshape(3, 3)
        # a free joint's velocity is in the world's frame, its rate of turning in the body's
        turning = np.cross(axes @ self.data.qvel[3:6], axes[:, 0])
        times = np.array([[-INSTANT], [0.0], [INSTANT]])
        before, now, after = self.on_wall(point + times * velocity, axes[:, 0] + times * turning)
        self.pose = now
        return State(now, (after - before) / (2 * INSTANT))

    def on_wall(self, points: Array, forwards: Array) -> Iterator[Array]:
        """Poses (3,) of points (n, 3) [m] that head (n, 3); each goes on from `pose`."""
        places = self.surface.under(points)
        _, frames = self.surface.at(places)
        turns = *self.surface.turn, 2 * math.pi
        for place, (ahead, aside, _) in zip(
            places, np.einsum("nij,ni->nj", frames, forwards), strict=True
        ):
            pose = *place.tolist(), math.atan2(aside, ahead)
            goes_on = zip(pose, self.pose.tolist(), turns, strict=True)
            yield np.array([was + math.remainder(now - was, turn) for now, was, turn in goes_on])


def _geoms(model: mujoco.MjModel) -> list[str]:
    return [model.geom(number).name for number in range(model.ngeom)]
