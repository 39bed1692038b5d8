"""Data to messages: nothing of it is lost."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.mechanics.quantities import State
from climber_uk.messages import writing
from climber_uk.messages.reading import state

numbers = st.floats(-3, 3)


@given(covariance=st.lists(numbers, min_size=9, max_size=9))
def test_a_planar_covariance_leaves_no_freedom_to_what_a_wall_takes(covariance):
    covariance = np.reshape(covariance, (3, 3))
    whole = np.reshape(writing.planar_covariance(covariance), (6, 6))
    planar, held = [0, 1, 5], [2, 3, 4]
    assert (whole[np.ix_(planar, planar)] == covariance).all()
    assert (whole[np.ix_(held, held)] == writing.UNKNOWN * np.eye(3)).all()
    assert not whole[np.ix_(planar, held)].any()
    assert not whole[np.ix_(held, planar)].any()


@given(pose=st.tuples(numbers, numbers, numbers), velocity=st.tuples(numbers, numbers, numbers))
def test_an_odometry_tells_the_state_that_it_is_made_of(pose, velocity):
    made = State(np.array(pose), np.array(velocity))
    message = writing.odometry(made, 1_500_000_001, "odom", "base_link")
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_001)
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    told = state(message, "odom", "base_link")
    np.testing.assert_allclose(told.pose, pose, atol=1e-12)
    np.testing.assert_allclose(told.velocity, velocity, atol=1e-12)
