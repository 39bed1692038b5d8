"""Runs in one bag are told apart where time starts again, and nowhere else."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_bag import BEGAN, SECOND, START, Made, a_run, write

from climber_uk.analysis.metrics import Case, evaluate
from climber_uk.analysis.recorded_run import read_run, read_runs
from climber_uk.analysis.restarts import restarts
from climber_uk.analysis.topics import Topics

ANYTHING = settings(deadline=None)
PERIOD = 5_000_000  # [ns]


def again(first, second, pause=SECOND):
    """Messages of two runs, the second recorded after the first."""
    last, start = max(message[2] for message in first), min(message[2] for message in second)
    later = last + pause - start
    return [*first, *((t, k, log + later, m) for t, k, log, m in second)]


@ANYTHING
@given(
    lengths=st.lists(st.integers(6, 40), min_size=1, max_size=5),
    back=st.one_of(st.integers(3, 12), st.integers(10, 10**6)),
    off=st.sampled_from([0, 0.3, 0.5]),
    repeats=st.integers(0, 12),
    jitter=st.integers(0, 2**32),
)
def test_each_time_that_stamps_start_again_is_found(lengths, back, off, repeats, jitter):
    """By three messages or more, also if a plant that waits says its first again."""
    stamps, places = [], []
    begin = 10**9
    for length in lengths:
        places.append(len(stamps))
        run = begin + np.arange(length)
        begin = run[-1] + 1 - off - min(back, length)
        stamps += [run[0]] * repeats + run.tolist()
    stamps = np.array(stamps) * PERIOD
    if not repeats:
        stamps = stamps + np.random.default_rng(jitter).normal(0, 0.08 * PERIOD, len(stamps))
    assert restarts(np.round(stamps).astype(np.int64)) == places[1:]


@ANYTHING
@given(
    late=st.dictionaries(st.integers(0, 99), st.integers(1, 30), max_size=30),
    repeated=st.lists(st.integers(0, 99), max_size=30, unique=True),
    wrong=st.dictionaries(
        st.integers(0, 9), st.one_of(st.integers(200, 10**6), st.integers(-(10**6), -200))
    ),
)
def test_messages_that_come_late_or_twice_or_with_wrong_stamps_start_nothing_again(
    late, repeated, wrong
):
    """No more than one of some messages is late, or has a wrong stamp."""
    arrivals = {number: number for number in range(100)}
    moved = []
    for number, by in late.items():
        if all(abs(other - number - by) > 12 for other in moved):
            arrivals[number] = number + by + 0.5
            moved.append(number + by)
    order = sorted([*arrivals, *repeated], key=lambda number: (arrivals[number], number))
    for place, by in wrong.items():
        order[10 * place + 9] += by
    assert restarts(PERIOD * np.array(order)) == []


def test_stamps_in_the_wrong_order_throughout_are_one_run():
    assert restarts(PERIOD * np.arange(50)[::-1]) == []


def two_runs(by=0, error=0.5, n=100):
    """The second off to the left, with other torques, modes, parameters and true poses."""
    first = a_run(n)
    first.add_parameters(mass=4.0)
    first.add_mode(0.0, "following")
    first.add_truth(first.pose)
    second = Made(
        n,
        errors=lambda time: np.tile([0.0, error, 0.0], (len(time), 1)),
        torques=lambda time, _: np.full((len(time), 2), 2.0),
    )
    second.add_odometry()
    second.add_reference()
    second.add_torques()
    second.add_parameters(mass=6.0)
    second.add_mode(0.1, "no odometry", level=2)
    second.add_truth(second.pose + np.array([0, 0.01, 0]))
    for *_, sent in second.messages:
        if hasattr(sent, "header"):
            stamp = sent.header.stamp
            whole = stamp.sec * SECOND + stamp.nanosec + by
            stamp.sec, stamp.nanosec = divmod(whole, SECOND)
    return again(first.messages, second.messages)


@pytest.mark.parametrize(
    "by", [0, -START // 2, -60 * PERIOD, PERIOD // 2], ids=["equal", "sooner", "overlap", "between"]
)
def test_each_run_has_its_own_of_everything(tmp_path, by):
    bag = write(tmp_path / "bag", two_runs(by))
    runs, said = read_runs(bag, Topics())
    assert said == ["/odom: time starts again, there are 2 runs"]
    assert [run.part for run in runs] == ["run 1 of 2", "run 2 of 2"]
    assert [run.start for run in runs] == [START, START + by]
    assert [len(run.time) for run in runs] == [100, 100]
    assert [run.torques.tolist() for run in runs] == [[[1, 1]] * 100, [[2, 2]] * 100]
    assert [run.parameters["mass"] for run in runs] == [4.0, 6.0]
    assert [[e.text for _, e in run.events if e.kind == "mode"] for run in runs] == [
        ["following"],
        ["no odometry"],
    ]
    first, second = (evaluate(Case(run)) for run in runs)
    assert first["max_distance"] < 1e-9
    assert first["truth_max_distance"] < 1e-9
    assert second["max_distance"] == pytest.approx(0.5)
    assert second["truth_max_distance"] == pytest.approx(0.5, abs=0.011)


def test_a_simulation_that_was_restarted_many_times_has_as_many_runs(tmp_path):
    bag = a_run(40).messages
    for _ in range(11):
        bag = again(bag, a_run(40).messages)
    runs, said = read_runs(write(tmp_path / "bag", bag), Topics())
    assert said == ["/odom: time starts again, there are 12 runs"]
    assert [len(run.time) for run in runs] == [40] * 12


def test_one_run_is_not_read_of_a_bag_with_two(tmp_path):
    bag = write(tmp_path / "bag", two_runs())
    with pytest.raises(ValueError, match="bag has 2 runs of one climber: its time starts again"):
        read_run(bag)


def at_once(*numbers, by=0, apart=0.5):
    """Messages of climbers side by side, of so many messages each in the same time."""
    messages = []
    for i, n in enumerate(numbers):
        errors = partial(lambda i, time: np.tile([0.0, i * apart, 0.0], (len(time), 1)), i)
        made = Made(n, 0.5 / n, errors)
        made.stamps += i * by
        made.add_odometry()
        for topic, kind, log, sent in made.messages:
            messages.append((topic, kind, log - i * by, sent))
    return messages


AT_ONCE = {
    "one clock, in step": (at_once(100, 100), "more than 0.05 m from another with the same stamp"),
    "one clock, out of step": (at_once(100, 100, by=PERIOD // 2), "leaps to and fro"),
    "two rates": (at_once(100, 33), "leaps to and fro"),
    "three": (at_once(100, 100, 100, by=PERIOD // 3), "leaps to and fro"),
    "two clocks": (at_once(100, 100, by=1000 * SECOND), "stamps leap to and fro"),
    "two clocks, two rates": (at_once(100, 30, by=-3 * SECOND), "stamps leap to and fro"),
    "two clocks, at one place": (at_once(99, 98, by=9 * SECOND, apart=0), "stamps leap to and fro"),
}


@pytest.mark.parametrize(("messages", "said"), AT_ONCE.values(), ids=AT_ONCE)
def test_two_runs_at_once_are_refused(tmp_path, messages, said):
    """As of two plants, or a recorder that takes its time from a simulation that was restarted."""
    bag = write(tmp_path / "bag", messages)
    with pytest.raises(ValueError, match=f"/bag: .*{said}"):
        read_runs(bag, Topics())


@pytest.mark.parametrize("which", [[0], [7], [99], [0, 99], [5, 30, 60], [10, 11]])
@pytest.mark.parametrize("wrong", [0, 1, -5 * SECOND, START - 10 * SECOND, 2**31 * SECOND - 1])
def test_a_few_stamps_that_cannot_be_are_left_out(tmp_path, which, wrong):
    made = a_run(100)
    made.stamps[which] = wrong
    made.messages = [m for m in made.messages if "odom" not in m[0]]
    made.add_odometry()
    for number, (topic, kind, _, sent) in enumerate(made.messages):
        if topic == "/odom":
            made.messages[number] = (topic, kind, BEGAN + len(made.messages) + number, sent)
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    count = len(which)
    assert (
        f"/odom: {count} of 100 messages left out: stamp far off those around it ({count})" in said
    )
    assert run.time[-1] <= 0.5


def test_a_climber_that_jumps_or_whose_odometry_is_noisy_is_one_run(tmp_path):
    rng = np.random.default_rng(1)
    glitches = np.where(rng.random((400, 1)) < 0.1, rng.normal(0, 3, (400, 3)), 0)
    for number, errors in enumerate([rng.normal(0, 0.1, (400, 3)), glitches]):
        made = Made(errors=lambda _, errors=errors: errors)
        made.add_odometry()
        (run,), _ = read_runs(made.write(tmp_path / f"bag_{number}"), Topics())
        assert len(run.time) == 400


def test_a_small_step_back_of_the_clock_makes_two_runs_and_a_smaller_one_is_said(tmp_path):
    said = {}
    for back in (1, 2, 4, 7):
        made = a_run(100)
        made.stamps[50:] -= back * PERIOD
        made.messages.clear()
        made.add_odometry()
        for number, (topic, kind, _, sent) in enumerate(made.messages):
            made.messages[number] = (topic, kind, BEGAN + number, sent)
        said[back] = read_runs(made.write(tmp_path / f"bag_{back}"), Topics())[1]
    again = ["/odom: time starts again, there are 2 runs"]
    first = "/odom: 1 messages have the stamp of another, but not its values: the first one counts"
    assert said == {1: [first], 2: again, 4: again, 7: again}


def test_messages_that_are_sent_twice_agree(tmp_path):
    made = a_run(100)
    bag = write(tmp_path / "bag", [*made.messages, *made.messages])
    (run,), said = read_runs(bag, Topics())
    assert said == []
    assert (len(run.time), run.odometry.repeated) == (100, 100)


def test_only_the_climber_whose_time_starts_again_has_two_runs(tmp_path):
    other = a_run(100, namespace="/other")
    bag = write(tmp_path / "bag", [*two_runs(), *other.messages])
    runs, _ = read_runs(bag, Topics())
    assert [(run.name, run.part) for run in runs] == [
        ("", "run 1 of 2"),
        ("", "run 2 of 2"),
        ("other", ""),
    ]


def test_a_stray_message_before_the_run_costs_a_line(tmp_path):
    made = a_run(100)
    stray = Made(1)
    stray.stamps = stray.stamps + 1000 * SECOND
    stray.add_odometry()
    (topic, kind, _, sent), *_ = stray.messages
    bag = write(tmp_path / "bag", [(topic, kind, 1, sent), *made.messages])
    (run,), said = read_runs(bag, Topics())
    assert said == ["/odom: 1 of 101 messages left out: stamp far off those around it (1)"]
    assert len(run.time) == 100
    assert not math.isnan(evaluate(Case(run))["max_distance"])
