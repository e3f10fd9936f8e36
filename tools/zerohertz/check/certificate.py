"""Certificate of a stored gain table: every entry's LMIs, proven in exact rational arithmetic.

An entry is proven when its X and gamma satisfy X > 0, (14) for +dw0 and -dw0, (15), (16) and the
Euler disc with the float32 gain itself, at the speed by which the firmware finds it (entry number
times the float32 step).

Negative speed needs no proof of its own: with conj L, A(-w) + conj L C1 is the conjugate of
A(w) + L C1 by the form of A, and conjugation turns each LMI into the other vertex's with conj X.
That the entries are conjugated is the firmware's doing, and tested there; that L(0) is real, so
that both signs agree at standstill, is looked at in stored_table.py.

Between the grid speeds the firmware keeps the nearest entry's L. A is affine in w, and so is every
LMI with X, L and gamma fixed: what holds at both ends of an entry's interval holds inside it. The
ends are proven with INTERVAL_ROOM times the entry's gamma, as that is 1.01 x the least one at the
grid speed itself. The verdict on a table is that at the grid speeds; intervals are counted beside.
"""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Iterable
from fractions import Fraction

from zerohertz.check.exact import Matrix
from zerohertz.check.inequalities import (
    ALL,
    MS_PER_S,
    Machine,
    failing,
    hermitian,
    holds_alone,
)
from zerohertz.check.multiplier import X4, find_multiplier, gamma_multiplier
from zerohertz.check.stored_table import StoredTable

GAMMA = "gamma (14)"
HOLDS = (GAMMA, *ALL[3:])
_POLE_TOLERANCE = 1.0e-3  # 1/s: l_gain.json rounds the poles to 1e-4
_SHOWN_FAILURES = 5
INTERVAL_ROOM = Fraction(101, 100)
# Half a step, and 1e-6 of it for the firmware's rounding of w / step in float32.
_HALF_STEP = Fraction(1_000_001, 2_000_000)
NO_BOUND = "gamma < 1: gives no bound of the field orientation"

Progress = Callable[[int], None]


@dataclasses.dataclass(frozen=True)
class Report:
    """Verdict on one table. Angles and bands are worst cases over all entries."""

    name: str
    method: str
    entries: int
    proven: int  # entries of which all inequalities hold with one X
    max_gamma: float | None  # None: some entry has no finite gamma
    max_angle_deg: float | None  # 2 atan(gamma), bound of the field-orientation error; gamma < 1
    max_euler_radius: float  # |1 + T s|
    max_negative_gain_band_rad_s: float  # |w_x|: stator frequencies of negative adaptation gain
    holds: dict[str, int]  # inequality -> entries for which it holds with an X of its own
    faults: tuple[str, ...]
    failures: tuple[str, ...]  # the first entries that are not proven
    intervals: int = 0  # entries proven over all speeds that they serve, gamma INTERVAL_ROOM larger
    without_bound: int = 0  # entries with gamma >= 1 or none: nothing said of the field orientation

    @property
    def passed(self) -> bool:
        """Every entry is proven, whatever the method of the design."""
        return not self.faults and self.proven == self.entries


@dataclasses.dataclass(frozen=True)
class EntryReport:
    """What is proven about one entry, and its numbers."""

    gamma: float
    euler_radius: float
    band_rad_s: float
    holds: dict[str, bool]
    failing: tuple[str, ...]  # inequalities not proven with one X; empty: proven
    interval: bool  # proven at both ends of the speeds that the entry serves, and so between them
    fault: str | None


def certify(table: StoredTable, progress: Progress | None = None) -> Report:
    """Checks every entry; reads and writes nothing."""
    results = []
    for k in range(len(table.gain)):
        results.append(check_entry(table, k))
        if progress:
            progress(k + 1)
    worst_gamma = max(result.gamma for result in results)
    failures = _failures(table, results)
    faults = [*table.faults, *(result.fault for result in results if result.fault)]
    return Report(
        name=table.name,
        method=table.method,
        entries=len(results),
        proven=sum(not result.failing for result in results),
        max_gamma=worst_gamma if math.isfinite(worst_gamma) else None,
        max_angle_deg=_angle_bound_deg(worst_gamma),
        max_euler_radius=max(result.euler_radius for result in results),
        max_negative_gain_band_rad_s=max(result.band_rad_s for result in results),
        holds=_counts(results),
        faults=tuple(faults[:_SHOWN_FAILURES]),
        failures=tuple(failures[:_SHOWN_FAILURES]),
        intervals=sum(result.interval for result in results),
        without_bound=sum(not result.gamma < 1 for result in results),
    )


def _counts(results: Iterable[EntryReport]) -> dict[str, int]:
    """Inequality -> entries for which it holds."""
    holds = Counter(dict.fromkeys(HOLDS, 0))
    for result in results:
        holds.update(name for name, held in result.holds.items() if held)
    return dict(holds)


def _angle_bound_deg(gamma: float) -> float | None:
    return math.degrees(2 * math.atan(gamma)) if gamma < 1 else None


def _failures(table: StoredTable, results: Iterable[EntryReport]) -> list[str]:
    return [
        f"{_elec_per_min(table, k):.0f} elec. min^-1: not proven: {', '.join(result.failing)}"
        for k, result in enumerate(results)
        if result.failing
    ]


def check_entry(table: StoredTable, k: int) -> EntryReport:
    """Verdict on entry k alone."""
    machine, omega_rad_s = table.machine, k * table.step_rad_s
    l1, l2 = table.gain[k][:2], table.gain[k][2:]
    A = machine.error_matrix(omega_rad_s, l1, l2)
    gamma, X = table.gamma[k], table.X[k]
    if gamma is None or X is None:
        gamma, X, holds, unproven = _without_stored_multiplier(machine, A)
    else:
        unproven = failing(machine, A, gamma, hermitian(*X))
        holds = {name: not any(u.startswith(name) for u in unproven) for name in HOLDS}
    if table.method == "gamma_pr" and gamma is not None and gamma >= 1:
        unproven.append(NO_BOUND)
    poles = _poles_per_s(A)
    return EntryReport(
        gamma=math.inf if gamma is None else float(gamma),
        euler_radius=max(abs(1 + float(machine.period_s) * s) for s in poles),
        band_rad_s=_negative_gain_band_rad_s(A),
        holds=holds,
        failing=tuple(unproven),
        interval=not unproven and _interval_holds(table, k, gamma, hermitian(*X)),
        fault=_pole_fault(table, k, poles),
    )


def _interval_holds(table: StoredTable, k: int, gamma: Fraction, X: Matrix) -> bool:
    """The LMIs at both ends of the speeds that entry k serves, the last entry's too."""
    return not any(
        failing(
            table.machine,
            table.machine.error_matrix(
                end * table.step_rad_s, table.gain[k][:2], table.gain[k][2:]
            ),
            INTERVAL_ROOM * gamma,
            X,
        )
        for end in (k - _HALF_STEP, k + _HALF_STEP)
    )


def _without_stored_multiplier(
    machine: Machine, A: Matrix
) -> tuple[Fraction | None, X4 | None, dict[str, bool], list[str]]:
    """gamma and X, what holds, and what is not proven, where the table brings no X."""
    gamma, X = find_multiplier(machine, A)
    if X is not None:
        return gamma, X, dict.fromkeys(HOLDS, True), []
    gamma = gamma_multiplier(machine, A)
    holds = {GAMMA: gamma is not None} | holds_alone(machine, A)
    return (
        gamma,
        None,
        holds,
        [name for name, held in holds.items() if not held] + ["one X for all"],
    )


def _negative_gain_band_rad_s(A: Matrix) -> float:
    """|w_x|, w_x = Im det / Re tr: between 0 and w_x Re G1(j w_s) < 0, and the adaptation runs
    the wrong way. Zero exactly when G1 is positive real."""
    det_im = sum(
        sign * (x[0] * y[1] + x[1] * y[0])
        for sign, x, y in ((1, A[0][0], A[1][1]), (-1, A[0][1], A[1][0]))
    )
    trace_re = A[0][0][0] + A[1][1][0]
    return math.inf if trace_re >= 0 else abs(float(det_im / trace_re)) * MS_PER_S


def _poles_per_s(A: Matrix) -> list[complex]:
    a, b, c, d = (complex(float(x[0]), float(x[1])) for row in A for x in row)
    mean, half = (a + d) / 2, cmath.sqrt(((a - d) / 2) ** 2 + b * c)
    return [MS_PER_S * (mean + half), MS_PER_S * (mean - half)]


def _pole_fault(table: StoredTable, k: int, poles: list[complex]) -> str | None:
    stored = table.poles[k]
    for re, im in (stored[:2], stored[2:]):
        if min(abs(complex(re, im) - s) for s in poles) > _POLE_TOLERANCE:
            return f"poles: {re} {im:+}j at entry {k} is no pole of the observer"
    return None


def _elec_per_min(table: StoredTable, k: int) -> float:
    return float(k * table.step_rad_s) * 60 / (2 * math.pi)
