"""Current sensors whose offsets move after their calibration, in the closed loop."""

from __future__ import annotations

import numpy as np
import pytest
from harm import broken
from test_standing_faults import drift

from zerohertz.campaign.faults.judge import HARMLESS

END_A = 0.15  # of one phase against another, within 10 s


def swing_Nm(speed_rpm: float, load_pu: float, end_A: float, follow: float) -> float:
    """Rms of the torque about its mean in the last 3 s."""
    fault = drift(end_A, 10.0)
    row, record = broken(fault, speed_rpm, load_pu, after_s=12.0, offset_track=follow)
    assert row["verdict"] == HARMLESS, row
    return float(np.std(record["torque_Nm"][record.t_s > record.t_s[-1] - 3.0]))


@pytest.mark.parametrize(
    ("speed_rpm", "load_pu"),
    [(rpm, pu) for rpm in (-200.0, 120.0, 300.0, 1200.0) for pu in (-0.5, 0.5)]
    + [(60.0, 0.5)],  # at 2.4 Hz: by the average alone, all of the gain
)
def test_followed_they_hardly_swing_the_torque(speed_rpm: float, load_pu: float) -> None:
    still_Nm = swing_Nm(speed_rpm, load_pu, 0.0, 0.0)
    blind_Nm = swing_Nm(speed_rpm, load_pu, END_A, 0.0)
    assert blind_Nm > still_Nm + 0.05
    assert swing_Nm(speed_rpm, load_pu, END_A, 1.0) < still_Nm + 0.3 * (blind_Nm - still_Nm)
