from dataclasses import replace

import numpy as np

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.many import amended, chosen, indexed
from climber_uk.mechanics.quantities import Wrench

MANY = replace(Climber(), mass=np.array([1.0, 2.0, 3.0]))


def test_a_part_of_many_has_the_numbers_of_those_and_shares_the_rest():
    some = indexed((MANY, Wrench(np.array([4.0, 5.0, 6.0]), 7.0)), np.array([2, 0]))
    np.testing.assert_array_equal(some[0].mass, [3, 1])
    np.testing.assert_array_equal(some[1].force, [6, 4])
    assert some[0].yaw_inertia == MANY.yaw_inertia
    assert some[1].moment == 7.0
    assert indexed(Climber(), 0) == Climber()


def test_only_the_exceptional_ones_are_computed_anew():
    asked = []

    def negative(wrench):
        asked.extend(wrench.force.tolist())
        return Wrench(-wrench.force, 0.0)

    wrench = Wrench(np.array([1.0, 2.0, 3.0]), 9.0)
    got = amended(wrench.force > 1.5, wrench, negative, wrench)
    np.testing.assert_array_equal(got.force, [1, -2, -3])
    np.testing.assert_array_equal(got.moment, [9, 0, 0])
    assert asked == [2, 3]
    assert amended(wrench.force > 5, wrench, negative, wrench) is wrench
    np.testing.assert_array_equal(wrench.force, [1, 2, 3])


def test_of_one_the_exception_is_all_or_nothing():
    regular = Wrench(1.0, 2.0)
    assert amended(False, regular, lambda: Wrench(0.0, 0.0)) is regular
    assert amended(True, regular, lambda drive: Wrench(drive, 0.0), 5.0) == (5, 0)


def test_one_of_two_is_chosen_for_each():
    lighter = replace(MANY, mass=np.array([0.1, 0.2, 0.3]), yaw_inertia=0.5)
    mixed = chosen(np.array([True, False, True]), lighter, MANY)
    np.testing.assert_array_equal(mixed.mass, [0.1, 2.0, 0.3])
    np.testing.assert_array_equal(mixed.yaw_inertia, [0.5, 0.33, 0.5])
    assert mixed.wheel_radius == MANY.wheel_radius
