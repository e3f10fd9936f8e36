"""How far the estimated speed is from the measured one."""

from __future__ import annotations

import dataclasses

import numpy as np

from zerohertz.errors import UserError
from zerohertz.replay.log import FloatArray

# Within this share of the measured speed, for the rest of the log, the estimate has settled.
SETTLED_PU = 0.05


@dataclasses.dataclass(frozen=True)
class SpeedError:
    """Estimate minus measurement, electrical, from `from_s` to `until_s`."""

    from_s: float
    until_s: float
    samples: int
    rms_rad_s: float
    mean_rad_s: float
    max_rad_s: float  # of the magnitude
    rms_pu: float | None  # of the mean measured speed; None at standstill
    settled_s: float | None  # from here to the end within 5 %; None: never, or at standstill


def speed_error(
    t_s: FloatArray, estimate: FloatArray, measured: FloatArray, from_s: float, until_s: float
) -> SpeedError:
    """The statistics; UserError when no sample lies between the two times."""
    used = (t_s >= from_s - 1e-9) & (t_s <= until_s + 1e-9)
    if not np.any(used):
        raise UserError(
            f"--settle, --until: no sample between {from_s:g} s and {until_s:g} s; the log runs "
            f"from {t_s[0]:g} s to {t_s[-1]:g} s"
        )
    error = (estimate - measured)[used]
    rms_rad_s = float(np.sqrt(np.mean(np.square(error))))
    speed_rad_s = float(np.mean(np.abs(measured[used])))
    return SpeedError(
        from_s=float(t_s[used][0]),
        until_s=float(t_s[used][-1]),
        samples=int(np.sum(used)),
        rms_rad_s=rms_rad_s,
        mean_rad_s=float(np.mean(error)),
        max_rad_s=float(np.max(np.abs(error))),
        rms_pu=rms_rad_s / speed_rad_s if speed_rad_s > 0.0 else None,
        settled_s=_settled_s(t_s, estimate, measured, until_s),
    )


def _settled_s(
    t_s: FloatArray, estimate: FloatArray, measured: FloatArray, until_s: float
) -> float | None:
    seen = t_s <= until_s + 1e-9
    far = np.abs(estimate - measured)[seen] > SETTLED_PU * np.abs(measured[seen])
    if far[-1]:
        return None
    last_far = np.flatnonzero(far)
    return float(t_s[seen][last_far[-1] + 1]) if len(last_far) else float(t_s[0])
