import pytest

from climber_uk.mechanics.adhesion import Alarm

OK, WARNING, ERROR = 0, 1, 2


@pytest.mark.parametrize(
    ("margin", "level"),
    [(100.0, OK), (1.5, OK), (1.49, WARNING), (1.0, WARNING), (0.99, ERROR), (-1.0, ERROR)],
)
def test_a_margin_warns_below_the_one_limit_and_is_an_error_below_the_other(margin, level):
    assert Alarm(warn_margin=1.5, error_margin=1.0).level(margin) == level


@pytest.mark.parametrize(("margin", "level"), [(0.8, OK), (0.5, OK), (0.49, ERROR)])
def test_there_is_no_error_without_a_warning(margin, level):
    """Whoever lowers the warning alone wants to hear less, not more."""
    assert Alarm(warn_margin=0.5, error_margin=1.0).level(margin) == level
