"""Runs in one bag are told apart where time starts again, and nowhere else."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_bag import SECOND, START, Made, a_run, write

from climber_uk.bags.recorded_run import read_run, read_runs
from climber_uk.bags.restarts import restarts
from climber_uk.bags.topics import Topics
from climber_uk.report.metrics import Case, evaluate

ANYTHING = settings(deadline=None)
PERIOD = 5_000_000  # [ns]


def again(first, second, pause=SECOND):
    """Messages of two runs, the second recorded after the first."""
    last = max(message[2] for message in first.messages)
    start = min(message[2] for message in second.messages)
    later = last + pause - start
    return [*first.messages, *((t, k, log + later, m) for t, k, log, m in second.messages)]


@ANYTHING
@given(
    lengths=st.lists(st.integers(10, 40), min_size=1, max_size=5),
    back=st.integers(10, 10**6),
    repeats=st.integers(0, 12),
    swapped=st.integers(0, 3),
)
def test_each_time_that_stamps_start_again_is_found(lengths, back, repeats, swapped):
    """Also if a plant that waits says its first again, or a message comes late right after it."""
    stamps, places = [], []
    begin = 10**9
    for length in lengths:
        places.append(len(stamps))
        run = (begin + np.arange(length)).tolist()
        begin = run[-1] - max(back, length)
        run[swapped], run[swapped + 1] = run[swapped + 1], run[swapped]
        stamps += [min(run)] * repeats + run
    assert restarts(PERIOD * np.array(stamps)) == places[1:]


@ANYTHING
@given(
    late=st.dictionaries(st.integers(0, 99), st.integers(1, 30), max_size=30),
    repeated=st.lists(st.integers(0, 99), max_size=30, unique=True),
    wrong=st.dictionaries(st.integers(0, 9), st.integers(-(10**6), 10**6)),
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
    return again(first, second)


@pytest.mark.parametrize("by", [0, -START // 2, -60 * PERIOD], ids=["equal", "sooner", "overlap"])
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


def test_one_run_is_not_read_of_a_bag_with_two(tmp_path):
    bag = write(tmp_path / "bag", two_runs())
    with pytest.raises(ValueError, match="bag has 2 runs of one climber: its time starts again"):
        read_run(bag)


def test_two_runs_at_the_same_log_times_are_refused(tmp_path):
    """As of a recorder that takes its time from a simulation, which was restarted."""
    first = a_run(100)
    second = Made(100, errors=lambda time: np.tile([0.0, 0.5, 0.0], (len(time), 1)))
    second.add_odometry()
    bag = write(tmp_path / "bag", [*first.messages, *second.messages])
    said = r"/bag: no run on /odom: 100 messages are more than 0.05 m from another with the same"
    with pytest.raises(ValueError, match=said):
        read_runs(bag, Topics())


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
    assert "no run on /odom: 1 message of use" in said
    assert len(run.time) == 100
    assert not math.isnan(evaluate(Case(run))["max_distance"])
