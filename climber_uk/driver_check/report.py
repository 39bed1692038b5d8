"""Findings of the checks, each a verdict, a line and maybe a hint; as text and as JSON."""

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
    SKIP = "skip"  # not enough was seen


@dataclass(frozen=True)
class Finding:
    """Result of a check: verdict, line, hint, and its numbers."""

    verdict: Verdict
    said: str
    hint: str = ""  # how to mend what is wrong
    values: Mapping[str, float] = field(default_factory=dict)  # in SI units


Report = Mapping[str, Finding]  # by the name of the check


def passed(said: str, **values: float) -> Finding:
    """Finding of a check that passes."""
    return Finding(Verdict.PASS, said, "", values)


def warned(said: str, hint: str, **values: float) -> Finding:
    """Finding of a check that passes with a warning."""
    return Finding(Verdict.WARN, said, hint, values)


def failed(said: str, hint: str, **values: float) -> Finding:
    """Finding of a check that fails."""
    return Finding(Verdict.FAIL, said, hint, values)


def skipped(said: str) -> Finding:
    """Finding of a check that could not be made; `said` is why."""
    return Finding(Verdict.SKIP, said)


def graded(
    badness: float, bounds: tuple[float, float], said: str, hint: str, **values: float
) -> Finding:
    """Finding that passes up to the first bound, warns up to the second, else (or nan) fails."""
    warns, fails = bounds
    if badness <= warns:
        return passed(said, **values)
    return (warned if badness <= fails else failed)(said, hint, **values)


def has_failed(report: Report) -> bool:
    """Whether any check has failed."""
    return any(finding.verdict is Verdict.FAIL for finding in report.values())


def as_text(report: Report) -> str:
    """Report as text: a line for each check, and one for each hint."""
    lines = []
    for name, finding in report.items():
        lines.append(f"{finding.verdict.value}  {name:<11}  {finding.said}")
        lines += [f"{'':<19}→ {finding.hint}"] if finding.hint else []
    counts = {v: sum(f.verdict is v for f in report.values()) for v in Verdict}
    return "\n".join([*lines, ", ".join(f"{n} {v.value}" for v, n in counts.items() if n)])


def as_json(report: Report) -> str:
    """Report as JSON: the rows, and `ok` if none has failed."""
    rows = [
        {
            **{"check": name, **vars(finding), "verdict": finding.verdict.value},
            "values": {n: v if math.isfinite(v) else None for n, v in finding.values.items()},
        }
        for name, finding in report.items()
    ]
    return json.dumps({"ok": not has_failed(report), "rows": rows}, indent=2)
