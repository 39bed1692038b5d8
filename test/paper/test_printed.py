import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import sqrtm

from climber_uk.mechanics import udwadia_kalaba
from climber_uk.mechanics.climber import Climber, no_slip
from climber_uk.mechanics.quantities import State
from climber_uk.paper.printed import GAINS, A, PrintedSystem

PRINTED = PrintedSystem()
START = np.array([0.0, 6.0, 0.0, 10.0, 0.0, -0.6])
TRY = np.random.default_rng(5).normal(size=(200, 6)) * [5, 5, 4, 8, 8, 1]


def integrate(derivative, relative, absolute, start=START, until=20.0):
    solution = solve_ivp(derivative, (0, until), start, rtol=relative, atol=absolute)
    x_error = solution.y[0] - 10 * np.sin(solution.t)
    y_error = solution.y[1] - 6 * np.cos(solution.t)
    return solution.y.T, x_error, y_error


def side_slip(y):
    return y[:, 3] * np.sin(y[:, 2]) - y[:, 4] * np.cos(y[:, 2])


def test_the_start_has_the_matrices_by_hand():
    q, v = START[:3], START[3:]
    # m r = 5 · 0.027, J r / d = 0.33 · 0.027 / 0.3
    np.testing.assert_allclose(
        PRINTED.mass_matrix(q), [[0.135, 0, 0], [0, 0, 0.0297], [0, -1, 0]], atol=1e-15
    )
    # f r = 56.4 · 0.027 against the motion; ω ẋ = -6 in the third row, with a minus
    np.testing.assert_allclose(PRINTED.force(q, v), [-1.5228, 0, 6], atol=1e-12)
    # ẍ = 0, ÿ = -6 are met by the friction's counterpart alone
    np.testing.assert_allclose(PRINTED.constraint_force(0.0, q, v), [1.5228, 0, 0], atol=1e-9)
    np.testing.assert_allclose(PRINTED.torques(np.array([1.5228, 0, 0])), [0.7614, 0.7614])


def test_upright_at_rest_the_weight_counts_in_full():
    q = np.array([0.0, 0.0, np.pi / 2])
    np.testing.assert_allclose(
        PRINTED.force(q, np.zeros(3)), [-(56.4 + 49.05) * 0.027, 0, 0], atol=1e-12
    )
    np.testing.assert_allclose(
        PRINTED.mass_matrix(q), [[0, 0.135, 0], [0, 0, 0.0297], [1, 0, 0]], atol=1e-15
    )


def test_its_rows_are_newton_euler_and_no_slip_of_the_climber():
    # an independent derivation: the consistent climber's motion fulfils the printed equations
    climber, torques = Climber(), np.array([1.3, -0.4])
    for pose, (v, omega) in zip(TRY[:, :3], TRY[:, 3:5], strict=True):
        state = State.rolling(pose, v, omega)
        q_2 = climber.rolling_acceleration(state, torques, 1.0)
        left = PRINTED.mass_matrix(pose) @ q_2 - PRINTED.force(pose, state.velocity)
        np.testing.assert_allclose(left, [0.9, 1.7, 0], atol=1e-9)


def test_the_printed_mass_matrix_is_refused_by_the_equation_it_is_put_into():
    M = PRINTED.mass_matrix(np.array([0.0, 0.0, 0.7]))
    with pytest.raises(ValueError, match="symmetric"):
        udwadia_kalaba.constraint_force(M, np.zeros(3), A, np.zeros(2))


def test_the_principal_root_is_complex_at_some_headings_and_real_at_others():
    poses = np.zeros((2000, 3))
    poses[:, 2] = np.linspace(-np.pi, np.pi, 2000)
    M = PRINTED.mass_matrix(poses)
    root = sqrtm(M)
    np.testing.assert_allclose(root @ root, M, atol=1e-9)
    is_complex = np.abs(root.imag).max(axis=(1, 2)) > 1e-9
    assert 0.01 < is_complex.mean() < 0.2  # measured 5 % of all headings


@pytest.mark.parametrize("gain", ["real part", "kept complex", "(A M⁻¹)⁺"])
def test_the_path_is_met_in_x_and_y_under_these_readings(gain):
    system = PrintedSystem(gain=gain)
    q_2 = system.uncorrected(0.7, TRY)[:, 3:]
    demanded = np.broadcast_to([-10 * np.sin(0.7), -6 * np.cos(0.7)], (200, 2))
    np.testing.assert_allclose(q_2[:, :2], demanded, atol=1e-7)
    q_1 = system.corrected(0.7, TRY)[:, :2]
    expected = np.broadcast_to([10 * np.cos(0.7), -6 * np.sin(0.7)], (200, 2))
    np.testing.assert_allclose(q_1, expected, atol=1e-7)


def test_force_and_acceleration_belong_together():
    Qc = PRINTED.constraint_force(0.7, TRY[:, :3], TRY[:, 3:])
    q_2 = PRINTED.uncorrected(0.7, TRY)[:, 3:]
    for y, force, acceleration in zip(TRY, Qc, q_2, strict=True):
        M, Q = PRINTED.mass_matrix(y[:3]), PRINTED.force(y[:3], y[3:])
        np.testing.assert_allclose(M @ acceleration, Q + force, rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("gain", ["real part", "kept complex", "Aᵀ (A M⁻¹ Aᵀ)⁺"])
def test_for_a_true_mass_these_readings_are_the_udwadia_kalaba_equation(gain):
    random = np.random.default_rng(2)
    factor = random.normal(size=(3, 3))
    M, Q, b = factor @ factor.T + np.eye(3), random.normal(size=3), random.normal(size=2)
    Qc = GAINS[gain](M) @ (b - A @ np.linalg.solve(M, Q))
    np.testing.assert_allclose(Qc, udwadia_kalaba.constraint_force(M, Q, A, b), atol=1e-10)


def test_torques_drop_the_third_component():
    torques = PRINTED.torques(np.array([3.0, 1.0, 100.0]))
    np.testing.assert_allclose(torques, [2.0, 1.0])  # τR + τL = 3, τR - τL = 1


def test_one_call_serves_many_climbers():
    together = PRINTED.corrected(0.3, TRY)
    for y, expected in zip(TRY, together, strict=True):
        np.testing.assert_allclose(PRINTED.corrected(0.3, y), expected, rtol=1e-7, atol=1e-7)


def test_an_unknown_reading_is_refused():
    with pytest.raises(ValueError, match="gain='imaginary' must be one of real part"):
        PrintedSystem(gain="imaginary")


@pytest.mark.parametrize(
    "derivative", [PRINTED.uncorrected, pytest.param(PRINTED.corrected, marks=pytest.mark.soak)]
)
def test_at_1e_8_the_path_is_met_to_1e_8_while_the_wheels_slip_sideways(derivative):
    y, x_error, y_error = integrate(derivative, 1e-8, 1e-11, until=7.0)
    assert np.abs(x_error).max() < 1e-8
    assert np.abs(y_error).max() < 1e-8
    assert np.abs(side_slip(y)).max() > 9
    third = PRINTED.constraint_force(7.0, y[-1, :3], y[-1, 3:])[2]
    assert abs(third) > 1  # although no motor acts in the row of no-slip


def test_at_relative_tolerance_1e_3_the_correction_makes_y_fifty_times_better():
    _, _, plain = integrate(PRINTED.uncorrected, 1e-3, 1e-3)
    _, _, corrected = integrate(PRINTED.corrected, 1e-3, 1e-3)
    assert abs(corrected[-1]) < abs(plain[-1]) / 50


def test_without_a_force_on_the_third_row_wheels_do_not_slip_but_miss_the_path():
    system = PrintedSystem(gain="Aᵀ (A M⁻¹ Aᵀ)⁺")
    y, x_error, _ = integrate(system.uncorrected, 1e-6, 1e-9)
    assert np.abs(side_slip(y)).max() < 1e-4
    assert np.abs(x_error).max() > 10
    A_slip, b_slip = no_slip(State(y[:, :3], y[:, 3:]))
    q_2 = system.uncorrected(1.0, y[5])[3:]
    assert A_slip[5] @ q_2 == pytest.approx(b_slip[5], abs=1e-6)
