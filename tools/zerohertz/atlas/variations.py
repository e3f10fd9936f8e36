"""Other plants for the same firmware: what the atlas says must not be a property of our simulation.

Every variation changes one thing of the bench (rigs/atlas.toml, boards/paper.toml) over a range a
real installation has, and nothing of what the firmware is told unless its reason says so.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from zerohertz.atlas.simulate import Bench, make_bench
from zerohertz.errors import UserError
from zerohertz.scenario.setup import Setup

RATED_FLUX_WB = 0.459  # 4.5 A through .102 H
LEAKAGE_H = 0.008
NAMEPLATE_M_H = 0.102


@dataclasses.dataclass(frozen=True)
class Variation:
    """One other plant: overrides of rig and board, and of the firmware where it would be told."""

    name: str
    range: str
    reason: str
    rig: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    board: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    firmware: Mapping[str, float] = dataclasses.field(default_factory=dict)


def _saturated(knee_Wb: float, exponent: int) -> dict[str, float]:
    """Main-flux saturation that leaves the nameplate's M at rated flux: it is measured there."""
    M_H = NAMEPLATE_M_H * (1.0 + (RATED_FLUX_WB / knee_Wb) ** exponent)
    return {
        "motor.saturation.flux_knee_Wb": knee_Wb,
        "motor.saturation.exponent": exponent,
        "motor.M_H": M_H,
        "motor.Lr_H": M_H,
        "motor.Ls_H": M_H + LEAKAGE_H,
    }


def _adc(bits: int) -> dict[str, float]:
    """One LSB of noise of an ADC this wide."""
    lsb = 2.0 ** (14 - bits)
    return {
        "sensors.current_noise_A": 0.00305 * lsb,
        "sensors.voltage_noise_V": 0.0488 * lsb,
        "sensors.dc_noise_V": 0.0244 * lsb,
    }


VARIATIONS: tuple[Variation, ...] = (
    Variation("nominal", "-", "the bench itself"),
    Variation(
        "fine_steps",
        "16 substeps of 12.5 us instead of one of 200 us",
        "the integrator's step",
        rig={"integration.substeps": 16},
    ),
    Variation(
        "heun",
        "order 2 in 10 substeps instead of order 4",
        "the integrator's method",
        rig={"integration.method": "heun", "integration.substeps": 10},
    ),
    Variation(
        "switched",
        "switched inverter, 5 kHz triangle, instead of period means",
        "pulse-width modulation and where in it the currents are sampled",
        rig={"inverter.model": "switched"},
    ),
    Variation(
        "saturation_soft",
        "M falls by 10 % from no flux to rated flux",
        "a machine designed below its knee",
        rig=_saturated(0.8, 4),
    ),
    Variation(
        "saturation_hard",
        "M falls by 17 % from no flux to rated flux, by half at 0.6 Wb",
        "a machine designed at its knee",
        rig=_saturated(0.6, 6),
    ),
    Variation(
        "iron_loss",
        "500 ohm: 60 W at rated flux and 60 Hz, 4 % of rated power",
        "the flux model of the observer has none",
        rig={"motor.iron_loss_ohm": 500.0},
    ),
    Variation(
        "iron_loss_high",
        "250 ohm: 120 W at rated flux and 60 Hz",
        "an old or small machine",
        rig={"motor.iron_loss_ohm": 250.0},
    ),
    Variation(
        "no_friction",
        "0 instead of 0.4 Nm",
        "friction damps the speed and hides small errors at standstill",
        rig={"mechanics.coulomb_Nm": 0.0},
    ),
    Variation(
        "friction",
        "0.8 Nm sliding and 1.2 Nm static instead of 0.4 Nm, and 5 mNm s: 0.9 Nm at 1710 min^-1",
        "a stiff gearbox: sticks and breaks away",
        rig={
            "mechanics.coulomb_Nm": 0.8,
            "mechanics.static_Nm": 1.2,
            "mechanics.viscous_Nms": 0.005,
        },
    ),
    Variation(
        "inertia_low",
        "0.015 instead of 0.035 kg m2, the firmware not told",
        "the bare motor",
        rig={"mechanics.J_kg_m2": 0.015},
    ),
    Variation(
        "inertia_high",
        "0.070 instead of 0.035 kg m2, the firmware not told",
        "a load as heavy again",
        rig={"mechanics.J_kg_m2": 0.070},
    ),
    Variation(
        "filter_slow",
        "line-voltage filters of 560 Hz instead of 800 Hz, the firmware not told",
        "parts of the filters off by 30 %, more than any tolerance",
        board={"filter.voltage_cutoff_Hz": 560.0},
    ),
    Variation(
        "filter_fast",
        "1600 Hz, damping 1.0 (two equal poles), the firmware not told",
        "another filter",
        board={"filter.voltage_cutoff_Hz": 1600.0, "filter.voltage_damping": 1.0},
    ),
    Variation(
        "adc_12_bit",
        "12 instead of 14 bit, 1 LSB of noise: 12 mA, 0.2 V",
        "the ADC of a microcontroller (boards/stm32f405.toml)",
        rig=_adc(12),
        board={"adc.bits": 12},
    ),
    Variation(
        "adc_10_bit",
        "10 bit, 1 LSB of noise: 49 mA, 0.8 V",
        "beyond what any current board has",
        rig=_adc(10),
        board={"adc.bits": 10},
    ),
    Variation(
        "delay_2",
        "two periods from sample to duty instead of one, delay_comp_periods 2.5",
        "a slower processor whose integrator knows it",
        board={"control.delay_periods": 2},
        firmware={"delay_comp_periods": 2.5},
    ),
    Variation(
        "delay_2_untold",
        "the same, the firmware not told",
        "a port that is wrong about its timer",
        board={"control.delay_periods": 2},
    ),
)


def benches(
    setup: Setup,
    firmware: Mapping[str, float],
    plant: Mapping[str, Any],
    name: str | None,
) -> dict[str, Bench]:
    """The bench under each variation asked for, by its name; the usual one under "" without.

    The user's own firmware and plant have the last word.
    """
    if name is None:
        return {"": make_bench(setup, firmware, plant)}
    return {
        v.name: make_bench(setup, {**v.firmware, **firmware}, {**v.rig, **v.board, **plant})
        for v in variations(name)
    }


def variations(name: str) -> tuple[Variation, ...]:
    """One by name, or `all`."""
    if name == "all":
        return VARIATIONS
    found = tuple(v for v in VARIATIONS if v.name == name)
    if not found:
        known = ", ".join(v.name for v in VARIATIONS)
        raise UserError(f"--variation: '{name}' is unknown; known are all, {known}")
    return found
