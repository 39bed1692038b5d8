import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from climber_uk.campaign import parts, running
from climber_uk.campaign.campaign import read
from climber_uk.campaign.parts import Store, computed

COMMAND = Path(sys.executable).parent / "campaign"
PLANT, CONTROLLER = "plant_simulator.", "uk_torque_controller."
TIMEOUT = 500.0  # [s]
# some spin, some are too weak, some lose their suction, all err
ALL_SORTS = {
    PLANT + "initial_yaw_rate": {"uniform": [-9.0, 9.0]},
    CONTROLLER + "max_wheel_torque": {"uniform": [0.5, 3.0]},
    PLANT + "pressure_loss_time": {"uniform": [0.0, 0.2]},
    PLANT + "pressure_loss_level": {"uniform": [0.0, 2500.0]},
    PLANT + "position_noise": {"uniform": [0.0, 1e-3]},
}


def wait(condition):
    until = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.002)


def test_a_run_has_the_same_bits_alone_as_among_any_others(campaign):
    found = campaign(ALL_SORTS)
    whole = computed(found, 0, 100)
    verdicts = set(whole["verdict"].to_pylist())
    assert len(verdicts) > 2  # it is about all sorts
    assert (whole["saturation"].to_numpy() > 0).any()
    for first, number in ((0, 1), (99, 1), (5, 2), (0, 33), (40, 60)):
        assert computed(found, first, number).equals(whole.slice(first, number))


@pytest.fixture
def many(monkeypatch, campaign):
    """Campaign in ten parts."""
    monkeypatch.setattr(parts, "PART", 10)
    return campaign(ALL_SORTS)


def rows(store):
    return [store.row(run) for run in range(store.runs)]


def column(store, name):
    return np.concatenate([batch[name] for batch in store.batches([name])])


def whole_of(campaign):
    return computed(campaign, 0, campaign.size.runs).to_pylist()


@pytest.mark.slow
def test_processes_give_every_run_once_and_the_same(many, tmp_path):
    store = Store(tmp_path / "out", many)
    with running.processes(2) as workers:
        running.run_missing(many, store, workers)
    assert rows(store) == whole_of(many)
    np.testing.assert_array_equal(column(store, "run"), np.arange(100))


class Here:
    """Computes at once what is submitted, and counts."""

    def __init__(self):
        self.firsts = []

    def submit(self, function, campaign, first, number):
        self.firsts.append(first)
        future = running.Future()
        future.set_result(function(campaign, first, number))
        return future


def test_what_is_there_is_not_computed_again(many, tmp_path):
    store = Store(tmp_path / "out", many)
    store.keep([*store.parts][3], computed(many, 30, 10))
    here = Here()
    running.run_missing(many, Store(tmp_path / "out", many), (here, 2))
    assert here.firsts == [0, 10, 20, 40, 50, 60, 70, 80, 90]
    assert rows(store) == whole_of(many)


def test_no_more_is_in_hand_than_workers_can_take(many, tmp_path):
    store, in_hand = Store(tmp_path / "out", many), []

    class Counting(Here):
        def submit(self, *task):
            in_hand.append(1 + len(self.firsts) - len([*store.directory.glob("*.parquet")]))
            return super().submit(*task)

    running.run_missing(many, store, (Counting(), 3))
    assert max(in_hand) == 3
    assert rows(store) == whole_of(many)


@pytest.mark.parametrize(
    ("parameters", "entries", "said"),
    [
        ({}, {"seed": 8}, "seed 7, not 8"),
        ({}, {"runs": 50}, "runs 100, not 50"),
        ({}, {"limits": ["fell == 0"]}, "limits max_distance < 0.03, fell == 0, not fell == 0"),
        ({PLANT + "mass": {"uniform": [4.0, 7.0]}}, {}, "plant_simulator.mass"),
        ({CONTROLLER + "mass": 5.1}, {}, "uk_torque_controller.mass 5.0, not 5.1"),
        ({PLANT + "half_track": {"uniform": [0.3, 0.4]}}, {}, "plant_simulator.half_track 0.3"),
    ],
)
def test_another_campaign_does_not_go_on_with_what_is_there(
    campaign, tmp_path, parameters, entries, said
):
    Store(tmp_path / "out", campaign())
    Store(tmp_path / "out", campaign())
    with pytest.raises(ValueError, match=r".") as refused:
        Store(tmp_path / "out", campaign(parameters, **entries))
    assert said in str(refused.value)


@pytest.mark.parametrize("text", ["", "[]", "[" * 10**5, "{"])
def test_what_no_campaign_has_written_is_not_gone_on_with(campaign, tmp_path, text):
    (tmp_path / "campaign.json").write_text(text)
    with pytest.raises(ValueError, match=r"campaign\.json is not what a campaign writes"):
        Store(tmp_path, campaign())


@pytest.mark.slow
def test_a_killed_campaign_goes_on_and_leaves_no_process(campaign_file, tmp_path):
    file, output = campaign_file(runs=8 * parts.PART, duration=0.01), tmp_path / "out"
    command = [COMMAND, file, "--output", output, "--jobs", "1"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    wait(lambda: list((output / "runs").glob("*.parquet")))
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    process.send_signal(signal.SIGKILL)
    process.wait(TIMEOUT)
    wait(lambda: not any(is_running(int(child)) for child in children))
    campaign = read(file)
    store = Store(output, campaign)
    assert 0 < len([*store.missing]) < 8

    running.run_missing(campaign, store, (Here(), 2))
    for part in (0, 3, 7):
        first = part * parts.PART
        expected = computed(campaign, first, 5).to_pylist()
        assert [store.row(first + k) for k in range(5)] == expected
    np.testing.assert_array_equal(column(store, "run"), np.arange(8 * parts.PART))
    masses = campaign.columns(0, campaign.size.runs)[PLANT + "mass"]
    np.testing.assert_array_equal(column(store, PLANT + "mass"), masses)


def is_running(pid):
    try:
        os.kill(pid, 0)
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except (ProcessLookupError, FileNotFoundError):
        return False


@pytest.mark.soak
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_dask_cluster_that_loses_a_worker_loses_nothing(many, tmp_path):
    distributed = pytest.importorskip("distributed")
    local = distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=":0")
    store = Store(tmp_path / "out", many)
    with local, running.cluster(local.scheduler_address) as (executor, at_once):
        killed = []

        class Killing:
            """Kills a worker after the fifth part was submitted."""

            def submit(self, *task):
                future = executor.submit(*task)
                if len(killed) == 5:
                    os.kill(local.workers[0].pid, signal.SIGKILL)
                killed.append(task)
                return future

        running.run_missing(many, store, (Killing(), at_once))
    assert rows(store) == whole_of(many)


@pytest.mark.slow
def test_the_command_tells_what_came_out_and_how_to_run_the_worst_again(campaign_file, tmp_path):
    command = [COMMAND, campaign_file({PLANT + "initial_y": 6.1}), "--jobs", "1"]
    told = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=TIMEOUT)
    assert told.returncode == 0, told.stderr
    assert "100/100" in told.stderr
    assert "succeeded" in told.stdout
    assert re.search(rf"{COMMAND} {command[1]} --rerun \d+\n", told.stdout)
    written = {path.name for path in (tmp_path / "campaign_output" / "small").iterdir()}
    assert {"campaign.json", "runs", "report.txt", "histograms.png", "failures.png"} <= written
    assert "scatter_max_distance.png" in written


@pytest.mark.slow
def test_what_cannot_be_run_is_said_in_one_line(campaign_file, tmp_path):
    file = campaign_file(seed=-1)
    told = subprocess.run([COMMAND, file], capture_output=True, text=True, cwd=tmp_path)
    assert told.returncode == 2
    assert told.stderr == f"campaign: {file}: seed=-1 must be >= 0\n"
    assert not (tmp_path / "campaign_output").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    "package",
    [
        "pyarrow",
        "distributed",
        *(pytest.param(p, marks=pytest.mark.soak) for p in ("matplotlib", "tqdm")),
    ],
)
def test_a_package_that_is_not_there_is_named_before_anything_runs(
    campaign_file, tmp_path, package
):
    without = f"import sys; sys.modules[{package!r}] = None"
    code = f"{without}; from climber_uk.campaign.command import main; main()"
    command = [sys.executable, "-c", code, campaign_file(), "--scheduler", "tcp://nowhere"]
    told = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert told.returncode == 2
    assert told.stderr == f"campaign: not installed: {package} (pip install {package})\n"
    assert not (tmp_path / "campaign_output").exists()
