"""What a whole recording tells of each of its times: the estimates, gone through backwards.

    x̂ₖ = xₖ + C (x̂ₖ₊₁ - xₖ₊₁⁻)    P̂ₖ = Pₖ + C (P̂ₖ₊₁ - Pₖ₊₁⁻) Cᵀ    C = Pₖ Fᵀ (Pₖ₊₁⁻)⁻¹

after Rauch, Tung and Striebel (1965); ⁻ is predicted from the time before, by F.
"""

from collections.abc import Sequence

import numpy as np

from climber_uk.localization.history import Entry
from climber_uk.localization.kalman import LEAST, Estimate, predicted_with_jacobian
from climber_uk.localization.options import LocalizationOptions


def smoothed(entries: Sequence[Entry], options: LocalizationOptions) -> list[Estimate]:
    """Estimate at each entry by all entries.

    What was believed against the estimate of before says nothing of before: there it begins anew.
    """
    found = [entry.estimate for entry in entries]
    for k in range(len(entries) - 2, -1, -1):
        later = entries[k + 1]
        if later.anew:
            continue
        estimate = entries[k].estimate
        before, jacobian = predicted_with_jacobian(estimate, later.sample.travel, options)
        size = len(before.mean)
        gain = np.linalg.solve(
            before.covariance + LEAST * np.eye(size), jacobian @ estimate.covariance
        ).T
        covariance = (
            estimate.covariance + gain @ (found[k + 1].covariance - before.covariance) @ gain.T
        )
        mean = estimate.mean + gain @ (found[k + 1].mean - before.mean)
        found[k] = Estimate(mean, (covariance + covariance.T) / 2)
    return found
