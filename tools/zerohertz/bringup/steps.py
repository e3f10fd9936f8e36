"""The steps of a bring-up, in the order of README's safety list."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from zerohertz.bringup import judge, measure
from zerohertz.bringup.bench import Bench
from zerohertz.bringup.measure import Meter, Numbers
from zerohertz.bringup.person import Reading
from zerohertz.bringup.wiring import Finding

_SPEED = Reading("speed_rpm", "Tachometer, positive in the direction you want", "min^-1")


@dataclass(frozen=True)
class Step:
    """connect, does: what the person is told. shown: numbers of the report, and their texts."""

    name: str
    title: str
    connect: str
    does: str
    readings: tuple[Reading, ...]
    measure: Callable[[Bench, Meter], Numbers]
    judge: Callable[[Numbers, Numbers, Numbers], list[Finding]]
    shown: dict[str, str]
    gates: bool = False


STEPS = (
    Step(
        "supply",
        "Supply and dc link",
        "Current-limited supply of a few ten volts, hardware over-current trip, gate disable "
        "within reach. Motor connected, shaft free and guarded. Multimeter, dc volts, at the "
        "capacitors of the dc link.",
        "Nothing: gates off. It reads the dc link.",
        (Reading("u_dc_V", "Multimeter at the dc link", "V"),),
        measure.supply,
        judge.supply,
        {"u_dc_drive_V": "dc link by the drive, V", "u_dc_V": "by the meter, V"},
    ),
    Step(
        "still",
        "Currents and voltages at rest",
        "As before. The shaft stands still.",
        "Nothing: gates off. It measures the offsets of the current sensors, and what is left.",
        (),
        measure.still,
        judge.still,
        {
            **{f"offset_{x}_A": f"offset of channel {x}, A" for x in "uvw"},
            "noise_A": "noise, A rms",
            "line_V": "line voltage, V",
        },
    ),
    Step(
        "trips",
        "Trips of the dc link",
        "As before.",
        "Gates off. It moves its limits across the present voltage, so that both trips act, and "
        "puts them back. Provoke the hardware over-current trip yourself, by its own test.",
        (),
        measure.trips,
        judge.trips,
        {
            "over_voltage_faults": "fault bits above u_dc_max_V",
            "under_voltage_faults": "fault bits below u_dc_min_V",
        },
    ),
    Step(
        "turn",
        "Gates, phases and current sensors",
        "Clamp for direct current, arrow to the motor, on one motor cable after the other.",
        "Gates on, a few volts, no current control. The field turns once in 2 s; the shaft may "
        "follow by one pole pair. It stops, and a fifth of rated current flows for the clamp: in "
        "at u, out at w.",
        tuple(
            Reading(f"clamp_{x}_A", f"Clamp on the cable of terminal {x.upper()}", "A")
            for x in "uvw"
        ),
        measure.turn,
        judge.turn,
        {
            **{f"clamp_{x}_A": f"clamp on {x.upper()}, A" for x in "uvw"},
            "i_turning_alpha": "current that turns with the voltage, A/V",
            "i_mirrored_alpha": "current that turns against it, A/V",
            "i_mean_alpha": "standing current, A",
        },
        gates=True,
    ),
    Step(
        "direct",
        "Resistance and dead time",
        "Nothing new.",
        "Gates on, direct current along u at a fifth and two fifths of rated current: phases in "
        "the ratio 1 : -.5 : -.5. The shaft stands.",
        (),
        measure.direct,
        judge.direct,
        {
            **{f"{x}_high_A": f"current of phase {x}, A" for x in "uvw"},
            "Rs_ohm": "stator resistance, ohm",
            "leg_loss_V": "voltage lost in a leg, V",
        },
        gates=True,
    ),
    Step(
        "first_turn",
        "First turn",
        "Tachometer. No load. Keep away from the shaft: it turns at a tenth of the largest speed.",
        "Gates on, the magnetising current turns (I-f). It shows direction, speed, the motor's "
        "voltage and the line-voltage sensors.",
        (_SPEED,),
        measure.first_turn,
        judge.first_turn,
        {
            "asked_rpm": "speed asked for, min^-1",
            "speed_rpm": "tachometer, min^-1",
            "current_A": "current, A",
            "i_voltage": "voltage applied, V",
            "line_turning_alpha": "line voltage sensed over applied",
            "line_mirrored_alpha": "of it, turning backwards",
        },
        gates=True,
    ),
    Step(
        "closed_loop",
        "Vector control",
        "As before. Wait until the shaft stands still.",
        "Gates on, vector control at the same speed with the magnetising current and little more, "
        "then the stop ramp. The dc link has to take what braking returns.",
        (_SPEED,),
        measure.closed_loop,
        judge.closed_loop,
        {
            "estimate_rpm": "estimate, min^-1",
            "speed_rpm": "tachometer, min^-1",
            "current_A": "current, A",
            "u_dc_after_V": "dc link after the stop, V",
        },
        gates=True,
    ),
)
NAMES = tuple(step.name for step in STEPS)
