"""The probability of an event, by how often it happened."""


def wilson(count: int, number: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a probability, of `count` events in `number` trials."""
    from scipy.stats import binomtest  # slow to import

    interval = binomtest(count, number).proportion_ci(confidence_level=0.95, method="wilson")
    return float(interval.low), float(interval.high)
