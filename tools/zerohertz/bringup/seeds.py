"""Wiring faults that a bring-up has to name, and the benches that they are seeded on."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from zerohertz.bringup.wiring import Finding
from zerohertz.commission.folder import RIGS
from zerohertz.paths import ROOT

GAIN_OFF = 0.1  # of a scale that is named
_PHASES = "uvw"
_PAIRS = {"u": "u and v", "v": "v and w", "w": "w and u"}


@dataclass(frozen=True)
class Seed:
    """faults: of a scenario; changes: of the rig, the drive is not told; firmware: it is told.

    expected: how the name begins; gain: the scale that it has to give.
    """

    name: str
    expected: str
    faults: Mapping[str, Any] = field(default_factory=dict)
    circuit: float = 1.0  # impedances of the motor over those that the drive is told
    changes: Mapping[str, Any] = field(default_factory=dict)
    firmware: Mapping[str, float] = field(default_factory=dict)
    gain: float | None = None
    lines: bool = False  # needs line-voltage sensors

    def named(self, findings: list[Finding]) -> bool:
        """By one of the findings, and no other part blamed first."""
        if not findings or not findings[0].name.startswith(self.expected):
            return False
        if self.gain is None:
            return True
        told = re.search(r"scaled by (-?[\d.]+)", findings[0].name)
        return told is not None and abs(float(told[1]) / self.gain - 1.0) < GAIN_OFF


@dataclass(frozen=True)
class Place:
    """A motor on a board; board None: scaled to the motor."""

    name: str
    rig: str
    board: str | None = None
    has_lines: bool = True

    def changes(self, seed: Seed) -> dict[str, Any]:
        """The seed's, and the circuit scaled."""
        if seed.circuit == 1.0:
            return dict(seed.changes)
        motor = tomllib.loads(self.rig)["motor"]
        names = ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H")
        found = {f"motor.{name}": seed.circuit * motor[name] for name in names}
        knee_Wb = seed.circuit**0.5 * motor["saturation"]["flux_knee_Wb"]
        return dict(seed.changes) | found | {"motor.saturation.flux_knee_Wb": knee_Wb}


def _sensor(word: str, kind: str, severity: float | None = None) -> dict[str, Any]:
    found = {"sensor": f'"{word}"', "kind": f'"{kind}"', "start_s": 0.0}
    return found if severity is None else found | {"severity": severity}


def _current_channels() -> list[Seed]:
    found = []
    for x in _PHASES:
        word = f"i_{x}"
        pair = f"current sensors {_PAIRS[x]} exchanged"
        found += [
            Seed(pair, pair, _sensor(word, "exchanged")),
            Seed(f"current sensor {x} inverted", f"current sensor {x} inverted",
                 _sensor(word, "gain", -1.0)),
            Seed(f"current sensor {x} dead", f"current sensor {x} dead", _sensor(word, "off")),
            Seed(f"current sensor {x} offset by 5 % of full scale", f"current sensor {x} offset",
                 _sensor(word, "offset", 0.05)),
        ]  # fmt: skip
        for gain in (0.5, 1.2, 2.0):
            found.append(
                Seed(f"current sensor {x} reads {gain} times", f"current sensor {x} scaled",
                     _sensor(word, "gain", gain), gain=gain)
            )  # fmt: skip
    found.append(
        Seed("all current sensors inverted", "all current sensors inverted",
             _sensor("currents", "gain", -1.0))
    )  # fmt: skip
    found += [
        Seed(f"all current sensors read {gain} times", "all current sensors scaled",
             _sensor("currents", "gain", gain), gain=gain)
        for gain in (0.5, 1.2, 2.0)
    ]  # fmt: skip
    return found


def _power() -> list[Seed]:
    found = [
        Seed("all motor phases open", "no current flows", {"open_phase": '"all"', "open_s": 0.0})
    ]
    for x in _PHASES:
        found.append(
            Seed(f"motor phase {x} open", f"motor phase {x} open",
                 {"open_phase": f'"{x}"', "open_s": 0.0})
        )  # fmt: skip
        for which in ("upper", "lower"):
            name = f"{which} switch of leg {x} does not turn on"
            found.append(Seed(name, name, {"dead_switch": f'"{x}_{which}"'}))
    for pair in ("uv", "vw", "wu"):
        text = _PAIRS[pair[0]]
        name = f"gates of legs {text} exchanged"
        found += [
            Seed(name, name, {"gates": f'"{pair}"'}),
            Seed(f"motor cables {text} exchanged", "turns backwards", {"cables": f'"{pair}"'}),
        ]
    return found


def _voltages() -> list[Seed]:
    name = "line-voltage sensors exchanged"
    found = [Seed(name, name, _sensor("u_uv", "exchanged"), lines=True)]
    for word in ("u_uv", "u_vw"):
        which = f"line-voltage sensor {word}"
        found.append(
            Seed(f"{which} inverted", f"{which} inverted", _sensor(word, "gain", -1.0), lines=True)
        )
        found += [
            Seed(f"{which} reads {gain} times", f"{which} scaled", _sensor(word, "gain", gain),
                 gain=gain, lines=True)
            for gain in (0.5, 1.2)
        ]  # fmt: skip
    found += [
        Seed(f"dc link reads {gain} times", "dc link scaled", _sensor("u_dc", "gain", gain),
             gain=gain)
        for gain in (0.8, 1.2)
    ]  # fmt: skip
    return found


def _configuration(dead_time_s: float) -> list[Seed]:
    return [
        Seed("dead time 2.5 times what the drive is told", "dead time wrong",
             changes={"inverter.dead_time_s": 2.5 * dead_time_s}),
        Seed("dead time half of what the drive is told", "dead time wrong",
             changes={"inverter.dead_time_s": 0.5 * dead_time_s}),
        Seed("star instead of delta", "motor wired in star", circuit=3.0),
        Seed("delta instead of star", "motor wired in delta", circuit=1.0 / 3.0),
        Seed("three pole pairs instead of two", "wrong number of pole pairs",
             changes={"motor.pole_pairs": 3}),
        Seed("swap_vw on", "turns backwards", firmware={"swap_vw": 1.0}),
    ]  # fmt: skip


def seeds_of(place: Place) -> list[Seed]:
    """Every one that this bench can have."""
    dead_time_s = tomllib.loads(place.rig)["inverter"]["dead_time_s"]
    found = [*_current_channels(), *_power(), *_voltages(), *_configuration(dead_time_s)]
    return [seed for seed in found if place.has_lines or not seed.lines]


def healthy_places() -> list[Place]:
    """Every published motor on a board that fits it, and the boards of the ports."""
    motors = [Place(path.stem, path.read_text("utf-8")) for path in sorted(RIGS.glob("*.toml"))]
    return motors + faulty_places()


def faulty_places() -> list[Place]:
    """The two that every fault is seeded on."""
    boards = ROOT / "host_sim" / "boards", ROOT / "hal" / "stm32g431"
    return [
        Place(
            "im_1kw5_200v on STM32F405",
            (RIGS / "im_1kw5_200v.toml").read_text("utf-8"),
            (boards[0] / "stm32f405.toml").read_text("utf-8"),
        ),
        Place(
            "low_voltage on B-G431B-ESC1",
            (RIGS.parent / "low_voltage.toml").read_text("utf-8"),
            (boards[1] / "esc.toml").read_text("utf-8"),
            has_lines=False,
        ),
    ]
