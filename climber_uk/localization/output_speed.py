"""Speed and yaw rate for the output: what encoders and IMU tell, each where it is good.

    v̂̇ = a + c + 2 Ω (v - v̂)    ċ = Ω² (v - v̂)    a = f_x - g_t sinθ

Counts of encoders make v rough, and a low-pass would make it late. The specific force has what is
quick, and c takes its bias. The yaw rate is the gyro's below 10 rad/s, and the wheels' above: there
it is the gyro that is rough. As counts are, too, it goes through a short low-pass.
"""

from climber_uk.localization.imu import Mean

FREQUENCY = 10.0  # [rad/s] Ω, above which the IMU tells of the speed
LATE = 0.01  # [s] by which the yaw rate is late


class OutputSpeed:
    """Goes on from one sample of the encoders to the next."""

    def __init__(self) -> None:
        self.speed = self._bias = self._yaw_rate = 0.0
        self._lag = Mean()  # [rad/s] by which the wheels' yaw rate is below the gyro's

    def go_on(self, speed: float, acceleration: float | None, duration: float) -> float:
        """Speed [m/s], from that of the encoders; without an acceleration [m/s²] it is theirs."""
        if acceleration is None:
            self.speed, self._bias = speed, 0.0
            return speed
        expected = self.speed + (acceleration + self._bias) * duration
        share = min(FREQUENCY * duration, 0.5)
        self.speed = expected + 2 * share * (speed - expected)
        self._bias += FREQUENCY * share * (speed - expected)
        return self.speed

    def yaw_rate(self, wheels: float, gyro: float, duration: float) -> float:
        """Yaw rate [rad/s] of both."""
        self._lag.add(gyro - wheels, duration)
        rate = wheels + self._lag.value
        self._yaw_rate += (rate - self._yaw_rate) * duration / (LATE + duration)
        return self._yaw_rate
