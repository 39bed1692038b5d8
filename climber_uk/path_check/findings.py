"""What `check_path` found, as numbers by name and in words."""

from typing import Any

from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.path_check.demands import Demands
from climber_uk.path_check.posterior import Chance, Posterior


def told(
    found: Demands, trajectory: Trajectory, half_track: float, remarks: list[str]
) -> dict[str, Any]:
    """What is found, as numbers by name; `remarks` gets what looks like a mistake."""
    about = summary(trajectory, half_track)
    remarks += about.remarks
    limits: dict[str, Any] = {
        least.name: {"reserve": least.reserve, "at [s]": least.time, "place [m]": least.place}
        for least in found.least()
    }
    return {
        "feasible": all(limit["reserve"] >= 1 for limit in limits.values()),
        "length [m]": about.length,
        "duration [s]": about.duration,
        "fastest [m/s]": about.fastest_speed,
        "energy of the wheels [J]": found.energy,
        "limits": limits,
    }


def told_of(posterior: Posterior, events: dict[str, Chance], runs: int) -> dict[str, Any]:
    """What the posterior makes probable, as numbers by name."""
    return {
        "climbers": runs,
        "drawn": {name: str(of) for name, of in posterior.items() if of},
        "not told": ", ".join(name for name, of in posterior.items() if not of),
        "events": {event: chance.numbers for event, chance in events.items()},
    }


def lines(numbers: dict[str, Any], is_whole: bool) -> list[str]:
    """The same in words."""
    part = "" if is_whole else ", once around"
    said = [
        f"{numbers['length [m]']:.4g} m, {numbers['duration [s]']:.4g} s, at most "
        f"{numbers['fastest [m/s]']:.3g} m/s, {numbers['energy of the wheels [J]']:.4g} J{part}"
    ]
    for name, limit in sorted(numbers["limits"].items(), key=lambda of: of[1]["reserve"]):
        x, y = (round(place, 3) + 0.0 for place in limit["place [m]"])  # no -0, no 4e-18
        verdict = "" if limit["reserve"] >= 1 else ": TOO MUCH"
        said.append(
            f"{name}: {limit['reserve']:.3g} times what is asked for, at ({x:g}, {y:g}) m, "
            f"{limit['at [s]']:.4g} s{verdict}"
        )
    if "fastest rate" in numbers:
        rate = numbers["fastest rate"]
        said.append(
            f"highest rate: {rate:.4g}, in {numbers['fastest duration [s]']:.4g} s"
            if rate
            else "highest rate: none is slow enough"
        )
    said += _fastest(numbers.get("fastest law", {}))
    said += _probable(numbers.get("posterior", {}))
    return [*said, "feasible" if numbers["feasible"] else "NOT feasible"]


def _fastest(law: dict[str, Any]) -> list[str]:
    """What the fastest law takes, or why there is none."""
    if not law:
        return []
    if "reason" in law:
        return [f"fastest law: none: {law['reason']}"]
    return [
        f"fastest law: {law['duration [s]']:.4g} s, at most {law['fastest [m/s]']:.3g} m/s; "
        f"least reserve {law['least reserve']:.4g}, of {law['limit']}"
    ]


def _probable(posterior: dict[str, Any]) -> list[str]:
    """What is drawn, and the probability of each event."""
    if not posterior:
        return []
    drawn = ", ".join(f"{name} {of}" for name, of in posterior["drawn"].items())
    said = [f"{posterior['climbers']} climbers drawn: {drawn}"]
    if posterior["not told"]:
        said.append(f"not told by the bag, so as in the parameter file: {posterior['not told']}")
    for event, of in posterior["events"].items():
        low, high = of["95 %"]
        said.append(f"{event}: {of['probability']:.2%} (95 %: {low:.2%} to {high:.2%})")
    return said
