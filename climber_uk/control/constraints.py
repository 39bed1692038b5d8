"""All constraint sets by name: a new one is a class as `ConstraintSet` says, and an entry here."""

from climber_uk.control.exact import Exact
from climber_uk.control.guidance import Guidance

CONSTRAINTS: dict[str, type[Guidance] | type[Exact]] = {"guidance": Guidance, "exact": Exact}
