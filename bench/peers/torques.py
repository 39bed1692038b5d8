"""One torque, and a whole tick, with the force of the constraints from where others have it.

All that is around it, the constraints' demand foremost, is the same; so are the torques, to 1e-9.
"""

from collections.abc import Callable, Mapping

import numpy as np
import tick
from limit import Limit
from peers.mujoco_climber import WithMuJoCo
from peers.pinocchio_climber import WithPinocchio, WithPinocchioMatrices
from side_by_side import in_turns, table, timed
from tick import PERIOD, TICKS, WARM, WithMatrices, bare, ticks, ways, with_known_targets

from climber_uk.control.constraints import CONSTRAINTS
from climber_uk.control.control_law import ControlInput, ControlLaw, ControlOptions
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State, Torques, Wrench
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

AGREEMENT = 1e-9  # [N m]


def by_schur(M: Array, Q: Array, A: Array, b: Array) -> Array:
    """Qc = Aᵀ (A M⁻¹ Aᵀ)⁻¹ (b - A a): two solves, without roots or singular values."""
    solved = np.linalg.solve(M, np.column_stack([A.T, Q]))
    return A.T @ np.linalg.solve(A @ solved[:, :-1], b - A @ solved[:, -1])


def laws(constraints: str, law: ControlOptions) -> dict[str, ControlLaw]:
    """Controllers that give the same torques; ours first."""
    climber, gains = Climber(), CONSTRAINTS[constraints]()
    return {
        **ways(constraints, law),
        "Schur complement, numpy": WithMatrices(climber, gains, law, solve=by_schur),
        "MuJoCo, inverse dynamics": WithMuJoCo(climber, gains, law),
        "Pinocchio, inverse dynamics": WithPinocchio(climber, gains, law),
        "Pinocchio, M and nonlinear effects": WithPinocchioMatrices(climber, gains, law),
    }


def check(controllers: Mapping[str, ControlLaw]) -> float:
    """Largest difference of torques [N m], near the ellipse; raises `SystemExit` if it is one."""
    random, largest = np.random.default_rng(8), 0.0
    path = Trajectory(Ellipse(), ConstantRate())
    for time in random.uniform(0, 20, 200):
        reference = path.at(time)
        pose = reference.pose + random.normal(0, 0.1, 3)
        v, omega = reference.speed + random.normal(), reference.yaw_rate + random.normal()
        motion = State.rolling(pose, float(v), float(omega)).motion
        situation = ControlInput(motion, Torques(0.0, 0.0), Wrench(0.5, -0.1), PERIOD)
        ours, *theirs = (c.command(situation, reference.target) for c in controllers.values())
        for name, other in zip(list(controllers)[1:], theirs, strict=True):
            off = float(np.abs(other.torques - ours.torques).max())
            if not off <= AGREEMENT:
                raise SystemExit(f"{name}: torque is {off:g} off, must be <= {AGREEMENT:g} [N m]")
            largest = max(largest, off)
    return largest


def in_c(limit: Limit, law: ControlLaw) -> Callable[[], None]:
    """Ticks of the law in C, for as long as there is `limit`."""
    run, torques = tick.ticks_in_c(limit, law)
    tick.check(law, run, torques)
    return run


def per_tick(time: Array) -> Array:
    """Time of one of `TICKS` [µs]."""
    return time / TICKS * 1e6


def compare(rounds: int) -> None:
    """Check and print the tables."""
    limit = Limit()
    for constraints in CONSTRAINTS:
        off = check(laws(constraints, ControlOptions()))
        print(f"\n{constraints}: torques of all agree to {off:.2g} N m in 200 states")
        alone = {
            name: timed(bare(law))
            for name, law in laws(constraints, ControlOptions(predict=False)).items()
        }
        table(f"one torque, {constraints}", in_turns(alone, rounds, WARM), "µs", per_tick)
        controllers = laws(constraints, ControlOptions())
        whole = {name: timed(ticks(law)) for name, law in controllers.items()}
        if constraints == "guidance":
            ours = next(iter(controllers.values()))
            same = with_known_targets(ours, in_c(limit, ours))
            whole |= {name: timed(run) for name, run in same.items()}
        table(f"a controller's tick, {constraints}", in_turns(whole, rounds, WARM), "µs", per_tick)
