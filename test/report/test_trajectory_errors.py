import numpy as np
import pytest
from evo.core import metrics, trajectory

from climber_uk.report.trajectory_errors import absolute_errors, relative_errors

PERIOD = 0.005  # [s]
TIME = np.arange(4000) * PERIOD


@pytest.fixture
def poses():
    """A reference and a climber that is off it: a line of many turns, drift and noise."""
    random = np.random.default_rng(7)
    heading = 0.4 * TIME
    reference = np.stack([3 * np.sin(heading), 2 * np.cos(heading), heading], axis=1)
    drift = np.stack([0.01 * TIME, 0.003 * TIME**2, 0.02 * np.sin(TIME)], axis=1)
    return reference, reference + drift + 1e-4 * random.normal(size=drift.shape)


def for_evo(pose):
    x, y, heading = pose.T
    zero = np.zeros_like(x)
    return trajectory.PoseTrajectory3D(
        np.stack([x, y, zero], axis=1),
        np.stack([np.cos(heading / 2), zero, zero, np.sin(heading / 2)], axis=1),
        TIME,
    )


RELATIONS = (
    metrics.PoseRelation.translation_part,
    metrics.PoseRelation.rotation_angle_rad,
)


def evos(measure, pair):
    measure.process_data(pair)
    return measure.error


def test_absolute_errors_are_those_of_evo(poses):
    pair = [for_evo(pose) for pose in poses]
    expected = [evos(metrics.APE(relation), pair) for relation in RELATIONS]
    np.testing.assert_allclose(absolute_errors(*poses).T, expected, atol=1e-7)


@pytest.mark.parametrize("delta", [0.25, 1.0])
def test_relative_errors_are_those_of_evo_in_time_and_along_the_way(poses, delta):
    pair = [for_evo(pose) for pose in poses]
    frames = round(delta / PERIOD)
    steps = np.hypot(*np.diff(poses[1][:, :2], axis=0).T)
    for progress, size, unit in (
        (TIME, frames, metrics.Unit.frames),
        (np.insert(np.cumsum(steps), 0, 0.0), delta, metrics.Unit.meters),
    ):
        expected = [evos(metrics.RPE(relation, size, unit), pair) for relation in RELATIONS]
        errors = relative_errors(*poses, progress, delta)
        np.testing.assert_allclose(errors.T, expected, atol=1e-7)


def test_by_hand_a_drift_is_seen_in_the_frame_of_the_reference():
    """The reference goes up 1 m each second; the climber, turned by a right angle, 1.1 m right."""
    reference = np.array([[0.0, i, np.pi / 2] for i in range(4)])
    pose = np.array([[1.1 * i, 0.0, 2 * np.pi] for i in range(4)])
    errors = relative_errors(reference, pose, np.arange(4.0), 1.0)
    np.testing.assert_allclose(errors, [[0.1, 0.0]] * 3, atol=1e-12)
    absolute = [[np.hypot(1.1 * i, i), np.pi / 2] for i in range(4)]
    np.testing.assert_allclose(absolute_errors(reference, pose), absolute, atol=1e-12)


def test_a_run_that_is_too_short_has_no_relative_error():
    still = np.zeros((3, 3))
    assert relative_errors(still, still, np.zeros(3), 1.0).shape == (0, 2)
    assert relative_errors(still, still, np.arange(3.0), 5.0).shape == (0, 2)
