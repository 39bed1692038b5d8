import numpy as np
import pytest
from scipy.integrate import quad

from climber_uk.mechanics.adhesion import Attachment, Grip, Magnetic
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.contact import LOCOMOTION, Contact, FourWheeled, Tracked


def test_tracks_resist_turning_as_their_scrubbing_integrated():
    tracks, load = Tracked(scrub_friction_coefficient=0.6, length=0.4), 120.0
    moment, _ = quad(lambda s: 0.6 * load / 0.4 * abs(s), -0.2, 0.2)
    assert tracks.turning_resistance(load) == pytest.approx(moment)
    assert LOCOMOTION["wheeled"]().turning_resistance(load) == 0


def test_four_wheels_resist_turning_by_half_their_wheelbase():
    wheels = FourWheeled(scrub_friction_coefficient=0.6, wheelbase=0.3)
    assert wheels.turning_resistance(120.0) == pytest.approx(0.6 * 120.0 * 0.15)


def test_tracks_without_length_are_refused():
    with pytest.raises(ValueError, match=r"length=0.0 must be > 0 \[m\]"):
        Tracked(length=0.0)


def test_a_contact_holds_as_its_hold_alone_whatever_it_runs_on():
    hold = {"adhesion": Magnetic(200.0), "grip": Grip(0.5)}
    contact, climber = Contact(**hold, locomotion=Tracked()), Climber()
    drive, lateral = np.array([[3.0, -20.0], [0.0, 50.0]])
    asked = (drive, -drive), lateral, 5.0
    expected = Attachment(**hold).slip_margin(climber, GRAVITY, *asked)
    np.testing.assert_array_equal(contact.slip_margin(climber, GRAVITY, *asked), expected)
