"""What the checks found: a verdict, a line and, where something is wrong, one hint."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum


class Verdict(Enum):
    """How a check ended."""

    PASS = "pass"
    WARN = "warn"
    FAIL = "fail"
    SKIP = "skip"  # nothing was seen that could tell


@dataclass(frozen=True)
class Finding:
    """What a check says, and by which numbers."""

    verdict: Verdict
    said: str
    hint: str = ""  # how to mend it
    values: Mapping[str, float] = field(default_factory=dict)  # in SI units


Report = Mapping[str, Finding]  # by the name of the check


def passed(said: str, **values: float) -> Finding:
    """All is well."""
    return Finding(Verdict.PASS, said, "", values)


def warned(said: str, hint: str, **values: float) -> Finding:
    """It works, but."""
    return Finding(Verdict.WARN, said, hint, values)


def failed(said: str, hint: str, **values: float) -> Finding:
    """It must be mended."""
    return Finding(Verdict.FAIL, said, hint, values)


def skipped(said: str) -> Finding:
    """Nothing can be told, and why."""
    return Finding(Verdict.SKIP, said)


def graded(
    badness: float, bounds: tuple[float, float], said: str, hint: str, **values: float
) -> Finding:
    """Pass up to the first bound of what is wrong, warn up to the second, fail beyond or if nan."""
    warns, fails = bounds
    if badness <= warns:
        return passed(said, **values)
    return (warned if badness <= fails else failed)(said, hint, **values)


def has_failed(report: Report) -> bool:
    """Whether anything has."""
    return any(finding.verdict is Verdict.FAIL for finding in report.values())


def as_text(report: Report) -> str:
    """Return a line for each check, and one for each hint."""
    lines = []
    for name, finding in report.items():
        lines.append(f"{finding.verdict.value}  {name:<11}  {finding.said}")
        lines += [f"{'':<19}→ {finding.hint}"] if finding.hint else []
    counts = {v: sum(f.verdict is v for f in report.values()) for v in Verdict}
    return "\n".join([*lines, ", ".join(f"{n} {v.value}" for v, n in counts.items() if n)])


def as_json(report: Report) -> str:
    """Return all of it for a machine: the rows, and whether none has failed."""
    rows = [
        {
            "check": name,
            "verdict": finding.verdict.value,
            "said": finding.said,
            "hint": finding.hint,
            "values": {
                key: value if math.isfinite(value) else None
                for key, value in finding.values.items()
            },
        }
        for name, finding in report.items()
    ]
    return json.dumps({"ok": not has_failed(report), "rows": rows}, indent=2)
