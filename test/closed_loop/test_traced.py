"""Loops by JAX are those by numpy. JAX is no part of `make test`: see CONTRIBUTING.md."""

from dataclasses import replace

import numpy as np
import pytest
from test_batch import BUILT, CASES, EIGHT, ELLIPSE, ON_EIGHT, PAPER, ROUND, SLOW, around

from climber_uk.closed_loop.batch import Change, Loops
from climber_uk.closed_loop.period import BatchRun
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.timing import Timing
from climber_uk.mechanics import elementary, many
from climber_uk.mechanics.quantities import Wrench
from climber_uk.simulation.sensors import Sensors

jax = pytest.importorskip("jax", reason="JAX is not installed: pip install jax")

pytestmark = pytest.mark.slow


def check(loops, course):
    by_numpy, by_jax = (loops.run(replace(course, backend=name)) for name in ("numpy", "jax"))
    for name, expected, got in zip(by_numpy._fields, by_numpy, by_jax, strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("name", ["from rest", "exact", "late", "too weak", "dc"])
def test_loops_are_those_of_numpy(name):
    trajectory, start, true, gains, known, steps, delay = CASES[name]
    law = ControlLaw(replace(BUILT if trajectory is EIGHT else PAPER, **known), gains)
    loops = Loops(start, true, law, timing=Timing(transport_delay=0.005 * delay))
    check(loops, BatchRun(trajectory, 0.8, steps=steps, delay=delay))


@pytest.mark.parametrize("time", [np.array([0.1, np.inf, 0.6, 0.75]), 0.3])
def test_so_are_loops_with_noise_that_lose_suction_and_are_told(time):
    lost = replace(BUILT, suction_pressure=np.array([300.0, 300.0, 700.0, 1500.0]))
    loops = Loops(
        start=ON_EIGHT,
        climber=replace(BUILT, seal_friction_coefficient=around(0.4)),
        law=ControlLaw(BUILT, SLOW),
        sensors=Sensors(position_noise=1e-3, heading_noise=1e-3, speed_noise=1e-2),
        seeds=np.arange(4),
        changes=(Change(time, lost),),
        timing=Timing(transport_delay=0.012),
        gauge=0.05,
    )
    check(loops, BatchRun(EIGHT, 1.0, delay=1))


@pytest.mark.parametrize("name", ["sphere", "roof"])
def test_so_are_loops_on_walls(name):
    wall, leaning = ROUND[name], replace(BUILT, inclination=70.0)
    loops = Loops(ON_EIGHT, leaning, ControlLaw(leaning, SLOW, wall=wall), wall=wall)
    check(loops, BatchRun(EIGHT, 0.8))


def test_a_period_that_no_stamp_can_tell_is_refused():
    loops = Loops(ON_EIGHT, BUILT, ControlLaw(BUILT, SLOW))
    with pytest.raises(ValueError, match="must be whole nanoseconds"):
        loops.run(BatchRun(ELLIPSE, 0.1, period=1 / 300, backend="jax"))


@pytest.mark.parametrize("largest", [0.02, 3.0, 40.0])
def test_any_angle_is_turned_by_as_numpy_turns_it(largest):
    from climber_uk.closed_loop import traced

    random = np.random.default_rng(5)
    heading, angle = random.uniform(-4, 4, 50), random.uniform(-largest, largest, 50)
    given = heading, np.cos(heading), np.sin(heading), angle
    got = elementary.rotated(*map(traced.jax.numpy.asarray, given))
    np.testing.assert_allclose(got, elementary.rotated(*given), rtol=0, atol=1e-13)


def test_what_is_not_known_is_left_open():
    some = jax.numpy.array([True, False])
    assert not elementary.everywhere(some)
    assert elementary.anywhere(~some & some)
    regular = Wrench(np.ones(2), 2.0)
    kept = many.amended(some, regular, lambda x: Wrench(x, -x), np.array([5.0, 6.0]))
    np.testing.assert_array_equal(kept, [[5.0, 1.0], [-5.0, 2.0]])
