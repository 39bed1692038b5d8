"""The constraint set `exact`: the reference's path itself."""

from climber_uk.mechanics.elementary import cos, select, sin
from climber_uk.mechanics.quantities import DesiredAcceleration, Motion, ReferencePoint
from climber_uk.parameters.declaration import parameter, parameters

REACH = 0.2  # [m] from the path, within which the exact set is expected to stay
REST_SPEED = 1e-3  # [m/s] below which v θ̈ says nothing of θ̈


@parameters(slots=True)
class Exact:
    """The path itself: p̈ = u = p̈_d + K_d (ṗ_d - ṗ) + K_p (p_d - p), and what it hides.

    With no-slip, p̈ = u leaves θ̈ open but binds the velocity: φ = v ω - n·u = 0. Differentiated,
    with a decay, it is the third row: v θ̈ = -v̇ ω + d/dt(n·u) - λ φ. Singular at rest, where θ̈
    is left at 0, and violent near it: for references that never slow down.
    """

    natural_frequency: float = parameter(
        6.0,
        "rad/s",
        "ω_n: K_p = ω_n², K_d = 2 ω_n",
        above=0,
        plausible=(0.1, 150.0),  # as guidance.frequency
        runtime=True,
    )
    hidden_rate: float = parameter(
        10.0,
        "1/s",
        "λ, rate at which the error φ of the hidden constraint decays",
        above=0,
        runtime=True,
    )

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """See `ConstraintSet`; offsets of up to `REACH` are expected to be corrected."""
        correction = self.natural_frequency * REACH
        return 2 * speed + correction, 2 * yaw_rate + self.natural_frequency

    def prepare(self, target: ReferencePoint) -> ReferencePoint:
        """See `ConstraintSet`."""
        return target

    def desired_acceleration(self, target: ReferencePoint, motion: Motion) -> DesiredAcceleration:
        """See `ConstraintSet`."""
        # here x, y, v_x … j_y are in the wall's frame; v and omega are the climber's
        x, y, _, cosine, sine, v, omega = motion
        x_d, y_d, heading_d, v_x, v_y, _, a_x, a_y, _, j_x, j_y = target
        K_d, K_p = 2 * self.natural_frequency, self.natural_frequency * self.natural_frequency
        e_x1, e_y1 = v_x - v * cosine, v_y - v * sine
        u_x = a_x + K_d * e_x1 + K_p * (x_d - x)
        u_y = a_y + K_d * e_y1 + K_p * (y_d - y)

        # what p̈ will be: u along the heading, and the centripetal v ω across it
        v_1, centripetal = u_x * cosine + u_y * sine, v * omega
        u_x1 = j_x + K_d * (a_x - v_1 * cosine + centripetal * sine) + K_p * e_x1
        u_y1 = j_y + K_d * (a_y - v_1 * sine - centripetal * cosine) + K_p * e_y1

        phi = centripetal - (u_y * cosine - u_x * sine)
        v_theta_2 = u_y1 * cosine - u_x1 * sine - 2 * v_1 * omega - self.hidden_rate * phi
        at_rest = abs(v) < REST_SPEED
        theta_2 = select(at_rest, 0.0, v_theta_2 / select(at_rest, 1.0, v))
        # friction is that of the speed at which the error along the track goes as exp(-ω_n t)
        wanted_x = v_x + self.natural_frequency * (x_d - x)
        wanted_y = v_y + self.natural_frequency * (y_d - y)
        wanted = wanted_x * cos(heading_d) + wanted_y * sin(heading_d)
        yaw_rate = omega - select(at_rest, 0.0, phi / select(at_rest, 1.0, v))
        return DesiredAcceleration(v_1, theta_2, wanted, yaw_rate)
