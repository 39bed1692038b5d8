"""A run of a campaign through the real nodes, in lock-step: what the closed loops said of it."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest
from bag_contents import read_messages
from world import CONFIG, executable

from climber_uk.campaign.campaign import read
from climber_uk.campaign.parts import computed
from climber_uk.mechanics import SECOND
from climber_uk.messages import reading

pytestmark = [pytest.mark.nodes, pytest.mark.soak]

DURATION = 1.0  # [s]
MARGINS = "/plant_simulator/margins"


def test_a_run_again_through_the_nodes_is_what_the_campaign_said(world, tmp_path):
    """With noise, unknown mass and friction, off the path, and with less suction after 0.4 s."""
    file = tmp_path / "campaign.yaml"
    text = (CONFIG / "campaign.yaml").read_text().replace("base: ", f"base: {CONFIG}/")
    text = text.replace("duration: 20.0", f"duration: {DURATION}")
    lost = ("[0.0, 1000.0]", "[0.3, 0.5]"), ("[0.0, 4000.0]", "[3000.0, 4000.0]")
    for before, after in lost:
        assert before in text
        text = text.replace(before, after)
    file.write_text(text)
    output = tmp_path / "run"
    command = [executable("campaign"), file, "--rerun", "3", "--output", output]
    told = subprocess.run(command, env=world.environment, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    bag = output / "demo" / "bag"
    poses, peaks, margins = {}, {}, {}
    for topic, _, message in read_messages(bag, ["/ground_truth", "/wheel_torques", MARGINS]):
        since = reading.nanoseconds(message.header.stamp) - SECOND
        if topic == MARGINS:
            margins[since] = message.vector.x, message.vector.y
        elif topic == "/wheel_torques":
            peaks[since] = np.abs(message.effort).max()
        else:
            poses[since] = reading.state(message, "odom", "base_link").pose
    # a recorder that is behind may lack the end: compare as far as it goes
    known, campaign = min(max(poses), max(peaks), round(DURATION * SECOND)), read(file)
    assert known > DURATION / 2 * SECOND
    scenario = replace(campaign.scenario, duration=known / SECOND)
    row = computed(replace(campaign, scenario=scenario), 3, 1).to_pylist()[0]
    stamps = [stamp for stamp in sorted(poses) if stamp <= known]
    reference = scenario.course().trajectory.at(np.array(stamps) / SECOND)
    offset = np.array([poses[stamp] for stamp in stamps]) - reference.pose
    distance = np.hypot(offset[:, 0], offset[:, 1])
    # the same noise: what is left is rounding, and Simpson's rule beside Runge-Kutta's
    assert np.sqrt(np.mean(distance**2)) == pytest.approx(row["rms_distance"], abs=1e-9)
    assert distance.max() == pytest.approx(row["max_distance"], abs=1e-9)
    assert distance[-1] == pytest.approx(row["end_distance"], abs=1e-9)
    peak = max(peaks[stamp] for stamp in stamps)
    assert peak == pytest.approx(row["peak_torque"], abs=1e-9)
    # the plant tells margins of the end of a period, the campaign of its begin
    slip, tip = np.min([margins[stamp] for stamp in margins if stamp <= known], axis=0)
    assert slip == pytest.approx(row["lowest_slip_margin"], rel=1e-2)
    assert tip == pytest.approx(row["lowest_tip_margin"], rel=1e-9)
