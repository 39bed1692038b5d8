import csv
import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from climber_uk.control.constraint_set import demanded, rows
from climber_uk.control.exact import Exact
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.udwadia_kalaba import velocity_correction
from climber_uk.paper import attempts, closed_loop, drift, motion, study, table
from climber_uk.paper.consistent import PAPER_PATH, ConsistentSystem
from climber_uk.simulation.plant import Plant

pytestmark = pytest.mark.slow

CONSISTENT = ConsistentSystem()
STABILISED = ConsistentSystem(natural_frequency=5.0, hidden_rate=10.0)


def near_the_path(count, spread, seed=1):
    """Times and states, with speeds of the paper's order."""
    random = np.random.default_rng(seed)
    times = random.uniform(0, 20, count)
    at = PAPER_PATH.at(times)
    y = np.concatenate([at.pose, at.velocity], axis=1)
    return times, y + spread * random.normal(size=y.shape)


# --- the consistent system ---


def test_on_the_path_the_constraint_demands_the_path():
    times, y = near_the_path(100, 0)
    at = PAPER_PATH.at(times)
    for system in (CONSISTENT, STABILISED):
        np.testing.assert_allclose(system.uncorrected(times, y)[:, 3:], at.acceleration, atol=1e-9)
        np.testing.assert_allclose(system.corrected(times, y)[:, :3], at.velocity, atol=1e-9)


def test_the_hidden_row_is_the_difference_of_the_hidden_constraint():
    # φ = v ω - n·u along any motion that obeys the forward and no-slip rows
    def phi(time, y):
        state = State(y[:3], y[3:])
        u = STABILISED._demand(state, PAPER_PATH.at(time))
        across = u[1] * np.cos(y[2]) - u[0] * np.sin(y[2])
        return state.forward_speed * state.yaw_rate - across

    h = 1e-6
    times, y = near_the_path(20, 0.1)
    for time, start in zip(times, y, strict=True):
        state = State.rolling(start[:3], State(start[:3], start[3:]).forward_speed, start[5])
        start = np.concatenate([state.pose, state.velocity])
        rate = STABILISED.uncorrected(time, start)
        change = phi(time + h, start + h * rate) - phi(time - h, start - h * rate)
        assert change / (2 * h) == pytest.approx(-10 * phi(time, start), abs=1e-3)


def test_stabilised_it_is_the_controllers_exact_constraint():
    exact = Exact(natural_frequency=5.0, hidden_rate=10.0)
    times, y = near_the_path(50, 0.1)
    for time, (q, v) in zip(times, y.reshape(-1, 2, 3), strict=True):
        state, reference = State.moving(State(q, v).motion), PAPER_PATH.at(time)  # without slip
        A, b = rows(state, demanded(exact, state, reference))
        np.testing.assert_allclose(
            STABILISED.uncorrected(time, np.concatenate([q, state.velocity]))[3:],
            np.linalg.solve(A, b),
            rtol=1e-9,
            atol=1e-8,
        )


def test_torques_and_lateral_reaction_make_up_the_whole_constraint_force():
    times, y = near_the_path(50, 0.1)
    state = State(y[:, :3], y[:, 3:])
    Qc = CONSISTENT.constraint_force(times, state)
    torques = CONSISTENT.torques(times, state)
    driven = State.rolling(state.pose, *CONSISTENT.climber.force_and_moment(torques)).velocity
    left_over = Qc - driven
    forward = left_over[:, 0] * np.cos(state.heading) + left_over[:, 1] * np.sin(state.heading)
    np.testing.assert_allclose(forward, 0, atol=1e-9)
    np.testing.assert_allclose(left_over[:, 2], 0, atol=1e-12)


def test_torques_at_the_start_are_those_by_hand():
    # level: τR + τL = f r; θ̈ = 0 there by symmetry: no turning
    np.testing.assert_allclose(CONSISTENT.reference_torques(0.0), [0.7614, 0.7614], atol=1e-12)


@pytest.mark.soak
@pytest.mark.parametrize("corrected", [False, True])
def test_at_1e_12_neither_position_nor_no_slip_err_by_1e_9(corrected):
    result = study.consistent(corrected, (1e-12, 1e-12))
    assert np.abs(result.error).max() < 1e-9
    assert np.abs(result.side_slip).max() < 1e-9
    assert np.abs(result.third).max() < 1e-9
    assert result.time[-1] == 20.0


def test_consistent_torques_drive_the_climber_open_loop_within_1e_7():
    result = motion.open_loop(CONSISTENT, 0.005)
    assert np.hypot(*result.error.T).max() < 1e-7
    assert np.abs(result.side_slip).max() < 1e-12


def test_the_open_loop_climber_is_the_simulated_one(monkeypatch):
    constant = np.array([1.1, 0.9])
    monkeypatch.setattr(
        ConsistentSystem, "reference_torques", lambda _, t: np.broadcast_to(constant, (len(t), 2))
    )
    result = motion.open_loop(CONSISTENT, 0.005)
    plant = Plant(CONSISTENT.climber, 0.005)
    end = plant.advance(State(motion.START[:3], motion.START[3:]), constant, 200)
    np.testing.assert_allclose(result.pose[200], end.pose, atol=1e-11)
    np.testing.assert_allclose(result.velocity[200], end.velocity, atol=1e-11)


# --- as printed ---


def test_torques_of_25_lead_the_climber_metres_off_the_path():
    printed = study.printed(True, motion.DEFAULT_TOLERANCE)
    driven = motion.driven_by(CONSISTENT, printed, 0.01)
    assert np.abs(driven.error).max() > 10
    assert np.abs(driven.side_slip).max() < 1e-9
    cells = table.row("driven", driven)
    assert float(cells[1]) > 10 or float(cells[4]) > 10


def test_semi_implicit_euler_of_10_ms_has_the_errors_that_the_paper_prints():
    plain, corrected = study.euler(False), study.euler(True)
    # by hand: ẍ = -10 sin t gives 10 h²/12 (t + sin t), ÿ = -6 cos t gives 3 h t
    t = plain.time
    np.testing.assert_allclose(plain.error[:, 0], 10 * 1e-4 / 12 * (t + np.sin(t)), atol=1e-6)
    np.testing.assert_allclose(plain.error[:, 1], -3 * 0.01 * t, atol=1e-4)
    assert np.abs(plain.error).max(axis=0) == pytest.approx([1.8e-3, 0.6], rel=0.05)
    # by hand, q̇ being b_q: 5 h (1 - cos t) and 3 h sin t, which do not grow
    expected = np.stack([-5 * 0.01 * (1 - np.cos(t)), 3 * 0.01 * -np.sin(t)], axis=-1)
    np.testing.assert_allclose(corrected.error, expected, atol=2e-4)


def test_an_attempt_that_gets_nowhere_says_where():
    assert attempts.attempt("gain modulus")[1].startswith("lost at")


# --- drift ---


@pytest.mark.parametrize(
    ("closed", "general"),
    [
        (drift.uncorrected, CONSISTENT.uncorrected),
        (drift.stabilised(5.0, 10.0), STABILISED.uncorrected),
        (drift.METHODS["corrected (30)"][0], CONSISTENT.corrected),
        (drift.corrected_literally, CONSISTENT.corrected_literally),
    ],
)
def test_closed_forms_are_the_general_solution(closed, general):
    times, states = near_the_path(50, 0.05)
    for time, y in zip(times, states, strict=True):
        got = closed(np.sin(time), np.cos(time), *y.tolist())
        np.testing.assert_allclose(got, general(time, y), rtol=1e-9, atol=1e-8)


def test_projection_is_the_least_change_onto_the_path_and_the_velocity_rows():
    M = CONSISTENT.climber.mass_matrix
    for time, y in zip(*near_the_path(20, 0.05), strict=True):
        at = PAPER_PATH.at(time)
        pose = velocity_correction(M, np.eye(2, 3), at.pose[:2], y[:3])
        state = CONSISTENT.corrected_state(State(pose, y[3:]), at)
        got = drift.projected(np.sin(time), np.cos(time), y[2])
        np.testing.assert_allclose(got, [*pose, *state.velocity], atol=1e-9)


def test_the_velocity_on_forward_no_slip_and_hidden_rows_meets_them():
    for time, y in zip(*near_the_path(20, 0.05), strict=True):
        at = PAPER_PATH.at(time)
        velocity = np.array(drift.forward_velocity(np.sin(time), np.cos(time), y[2]))
        state = State(y[:3], velocity)
        A, _ = CONSISTENT.rows(state, at)
        forward = np.cos(y[2]) * at.velocity[0] + np.sin(y[2]) * at.velocity[1]
        _, hidden = CONSISTENT.velocity_rows(state, at)
        np.testing.assert_allclose(A @ velocity, [forward, 0, hidden[2]], atol=1e-9)


def test_the_fast_runge_kutta_is_the_plain_one():
    fast = drift.runge_kutta("uncorrected (26)", 0.05, 20.0)
    times, y = motion.runge_kutta(CONSISTENT.uncorrected, 0.05)
    error = np.hypot(*(y[:, :2] - PAPER_PATH.at(times).pose[:, :2]).T)
    np.testing.assert_allclose(fast.error, error[::2], rtol=1e-5, atol=1e-12)


def test_after_1000_s_the_corrected_error_is_a_hundredth_and_has_not_grown():
    plain = drift.runge_kutta("uncorrected (26)", 0.01, 1000.0)
    corrected = drift.runge_kutta("corrected (30)", 0.01, 1000.0)
    assert corrected.largest < plain.largest / 100
    assert corrected.window(900, 1000) < 1.1 * corrected.window(0, 100)
    assert plain.window(900, 1000) > 10 * plain.window(0, 100)


def test_rows_at_v_let_v_part_from_the_corrected_velocity():
    literal = drift.runge_kutta("(30), rows at v", 0.01, 20.0)
    assert literal.largest < 1e-9
    assert literal.side_slip[-1] > 0.5
    assert drift.runge_kutta("corrected (30)", 0.01, 20.0).side_slip[-1] < 1e-8


def test_an_error_at_the_start_stays_under_30_and_goes_away_when_stabilised():
    start = study.OFF_CONSTRAINT
    runs = {m: drift.runge_kutta(m, 0.005, 20.0, start) for m in drift.COMPARED}
    assert runs["corrected (30)"].error[-1] == pytest.approx(0.1, abs=1e-6)
    assert runs["Baumgarte"].error[-1] < 1e-6
    assert runs["Braun & Goldfarb"].error[-1] < 1e-6
    assert runs["position projection"].error[-1] < 1e-6
    assert runs["uncorrected (26)"].error[-1] > 1


def test_embedded_corrections_are_none_on_the_path_and_take_violations_off_at_their_rate():
    closed, rate = drift.embedded(10.0), 10.0
    corrected = drift.METHODS["corrected (30)"][0]
    for time, y in zip(*near_the_path(20, 0.05), strict=True):
        S, C = np.sin(time), np.cos(time)
        on = np.array(drift.projected(S, C, y[2]))
        np.testing.assert_allclose(closed(S, C, *on), corrected(S, C, *on), atol=1e-9)
        off = np.subtract(y, on)
        more = np.subtract(closed(S, C, *y.tolist()), corrected(S, C, *y.tolist()))
        np.testing.assert_allclose(more, -rate * off * [1, 1, 0, 1, 1, 1], atol=1e-9)


def test_a_tighter_tolerance_drifts_less():
    errors = [drift.dormand_prince("uncorrected (26)", t, 50.0).largest for t in (1e-6, 1e-8)]
    assert errors[1] < errors[0] / 10


def test_a_run_that_got_lost_has_no_finite_error():
    lost = drift.Drift(np.arange(3.0), np.array([0.0, 1.0, 200.0]), np.zeros(3), 1)
    assert lost.largest == lost.window(0, 1) == np.inf


# --- tables and the command ---


def test_steps_that_went_astray_are_a_row_that_says_so(monkeypatch):
    def stuck(*_, **__):
        raise RuntimeError("stuck at 11.464 s: required step size is less than spacing")

    monkeypatch.setattr(motion, "dormand_prince", stuck)
    cells = table.row("as printed", study.coarse(corrected=False))
    assert cells == ("as printed: stuck at 11.464 s", *[""] * (len(table.COLUMNS) - 1))


def test_growth_is_the_slope_of_the_errors_size():
    time = np.linspace(0, 20, 50)
    assert table.growth(time, -0.03 * time) == pytest.approx(0.03)


def test_the_source_tree_has_the_scenario():
    config = closed_loop.find_config()
    assert config is not None
    assert config.name == "paper.yaml"


def test_without_rclpy_the_nodes_are_skipped_with_a_reason(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert closed_loop.record() == "rclpy is not installed"


def test_every_job_of_the_full_extent_has_a_key_of_its_own_and_is_complete():
    full = study.jobs(study.FULL)
    kinds = [key[0] for key in full]
    assert kinds.count("tolerance") == 40
    assert kinds.count("step") == 15
    assert ("nodes",) in full
    quick = dataclasses.replace(study.FULL, nodes=False)
    assert ("nodes",) not in study.jobs(quick)


DRAWN = (13,)  # all of them: `make paper`
QUICKER = f"""
from dataclasses import replace
from climber_uk.paper import figures, reproduce_paper as it
it.QUICK = replace(it.QUICK, tolerance=(1e-4, 1e-7), drift_time=5.0, drift_steps=(0.01,))
figures.FIGURES = {{number: figures.FIGURES[number] for number in {DRAWN}}}
it.main()
"""


@pytest.mark.soak  # 25 s; each job and each table has its own test
def test_quick_writes_every_figure_and_table(tmp_path):
    command = [sys.executable, "-c", QUICKER, "--quick"]
    done = subprocess.run(
        [*command, "--output", str(tmp_path)], capture_output=True, text=True, timeout=500
    )
    assert done.returncode == 0, done.stderr
    assert "[  1/" in done.stdout  # progress
    for name in ("as_printed", "as_printed_euler", "consistent"):
        for number in DRAWN:
            figure = tmp_path / f"figure_{number:02}_{name}.png"
            assert figure.read_bytes().startswith(b"\x89PNG")
    assert {"drift.png", "off_constraint.png"} <= {file.name for file in tmp_path.iterdir()}
    for name in ("comparison", "attempts", "drift"):
        with Path(tmp_path, f"{name}.csv").open(encoding="utf-8") as file:
            header, *lines = csv.reader(file)
        assert (tmp_path / f"{name}.md").read_text(encoding="utf-8") in done.stdout
        assert all(len(line) == len(header) for line in lines)
    with Path(tmp_path, "comparison.csv").open(encoding="utf-8") as file:
        by_name = {line[0]: line for line in csv.reader(file)}
    assert float(by_name["as printed, tolerance 0.0001, (26)"][7]) > 9  # side slip
    assert by_name["torques of (25) fed to the climber"][1]
    assert "closed loop through the nodes: left out by --quick" in by_name
    assert "as printed, default tolerance 1e-3, (26): left out by --quick" in by_name
