"""Motors with 1, 3 and 4 pole pairs: commissioned, their tables designed, and run in the loop.

Every published motor here has two pole pairs, and a 2 in the code would pass with all of them. The
same winding with other pole pairs has the same electrical circuit; torque goes with the pole pairs,
speed against them, and inertia with their square, so that all electrical quantities stay.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from zerohertz.commission import campaign
from zerohertz.commission.folder import rig_file

BASE = "im_1kw5_200v"


def rewound(pairs: int, folder: Path) -> Path:
    """The 1.5 kW motor's rig with other pole pairs."""
    ratio = pairs / 2.0
    scale = {
        "speed_rpm": 1.0 / ratio,
        "J_kg_m2": ratio**2,
        "coulomb_Nm": ratio,
        "viscous_Nms": ratio**2,
    }
    text = rig_file(BASE).read_text(encoding="utf-8")
    for name, factor in scale.items():
        pattern = re.compile(rf"^{name} = ([-+.\de]+)", re.MULTILINE)
        assert pattern.search(text), name
        text = pattern.sub(lambda m, f=factor, n=name: f"{n} = {float(m[1]) * f:.9g}", text)
    assert "\npole_pairs = 2\n" in text
    text = text.replace("\npole_pairs = 2\n", f"\npole_pairs = {pairs}\n")
    rig = folder / f"{BASE}_{pairs}.toml"
    rig.write_text(text, encoding="utf-8")
    return rig


@pytest.mark.parametrize("pairs", [1, 3, 4])
def test_a_motor_of_other_pole_pairs_is_found_and_run(pairs: int, tmp_path: Path) -> None:
    row = campaign.one_motor(rewound(pairs, tmp_path), seed=2)
    assert row.refusal is None
    assert row.found is not None
    assert row.plate.pole_pairs == pairs
    assert row.good, campaign.row_text(row)
