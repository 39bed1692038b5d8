"""All constraint sets by name, and control laws of other packages that are none.

A new constraint set is one class, a `ConstraintSet`, and one entry here, or an entry point
`climber_uk.constraints` of another package; a control law is an entry point
`climber_uk.controllers`, see `ForceLaw`.
"""

from climber_uk.control.constraint_set import ConstraintSet
from climber_uk.control.control_law import ForceLaw
from climber_uk.control.exact import Exact
from climber_uk.control.guidance import Guidance
from climber_uk.parameters.registry import Variants

CONSTRAINTS = Variants[type[ConstraintSet]]({"guidance": Guidance, "exact": Exact}, "constraints")
UDWADIA_KALABA = "udwadia_kalaba"  # the control law that follows one of them
FORCE_LAWS = Variants[type[ForceLaw]]({}, "controllers")
