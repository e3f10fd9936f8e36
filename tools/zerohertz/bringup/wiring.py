"""Which wiring explains what the slow turn measured? Pure functions; vectors are complex numbers.

The legs turn the commanded voltage u into v = T u: crossed gates, which the clamp on the cables
shows. The sensors turn the true current i = Y v into S i. S is a real 2 x 2 matrix, written as
S i = a i + b conj(i). The clamp gives the size of Y, the prediction its angle.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

AXES = {"u": 0.0, "v": 2.0 * math.pi / 3.0, "w": -2.0 * math.pi / 3.0}
# Exchanging two phases mirrors a vector at the axis of the third.
PAIRS = {"u and v": "w", "v and w": "u", "w and u": "v"}
OPEN_RATIO = (0.75, 1.3)  # of |B| and |A|: the current flows along one line
STANDING = 0.2  # mean over the turning part: half waves are missing
GAIN_OFF = 0.12  # of one channel: below, it is the sensor's tolerance
SCALE_OFF = 0.08  # of all three, against the clamp
MATRIX_FIT = 0.13
LINE_OFF = 0.1
LAG_OFF_RAD = 0.45


@dataclass(frozen=True)
class Finding:
    """A fault with its name (for programs), what it is, and what to do."""

    name: str
    text: str
    remedy: str


@dataclass(frozen=True)
class Turn:
    """Of the slow turn: A, B and c of its fit, the current at its end, by drive and by clamp."""

    turning: complex  # A/V
    mirrored: complex
    mean_A: complex
    volts: float
    hold_A: complex  # by the drive's sensors
    hold_V: complex  # commanded
    clamp_A: complex
    lag_rad: float  # of the current, as predicted


@dataclass(frozen=True)
class Linear:
    """a x + b conj(x)."""

    a: complex
    b: complex

    def __call__(self, x: complex) -> complex:
        return self.a * x + self.b * x.conjugate()

    def turned_back(self, by_rad: float) -> Linear:
        """Of a current that lags by so much more; no more than the prediction can be wrong."""
        back = cmath.exp(-1j * min(max(by_rad, -LAG_OFF_RAD), LAG_OFF_RAD))
        return Linear(self.a * back, self.b / back)

    def off(self, other: Linear) -> float:
        """Distance, at the lag that brings both together."""
        by_rad = cmath.phase(self.a * other.a.conjugate() + self.b.conjugate() * other.b)
        turned = self.turned_back(by_rad)
        return abs(turned.a - other.a) + abs(turned.b - other.b)


def _mirror(axis: str) -> Linear:
    return Linear(0.0, cmath.rect(1.0, 2.0 * AXES[axis]))


CROSSINGS = {
    "": Linear(1.0, 0.0),
    **{pair: _mirror(axis) for pair, axis in PAIRS.items()},
    "u to v, v to w, w to u": Linear(cmath.rect(1.0, AXES["v"]), 0.0),
    "u to w, w to v, v to u": Linear(cmath.rect(1.0, AXES["w"]), 0.0),
}


def broken_power(turn: Turn) -> Finding | None:
    """A switch that does not turn on, or a motor phase without current: needs no clamp."""
    A, B = abs(turn.turning), abs(turn.mirrored)
    size = A + B
    standing = abs(turn.mean_A) / (size * turn.volts)
    if standing > STANDING:
        return _dead_switch(turn.mean_A)
    if OPEN_RATIO[0] < B / max(A, 1e-9 * size) < OPEN_RATIO[1]:
        # B/A = -exp(2j axis) Y*/Y: the current that is missing.
        angle = cmath.phase(-turn.mirrored / turn.turning * cmath.exp(2j * turn.lag_rad))
        phase = min(AXES, key=lambda x: abs(_turned(angle - 2.0 * AXES[x])))
        return Finding(
            f"motor phase {phase} open",
            f"no current flows in motor phase {phase}",
            f"check cable, terminal and contactor of phase {phase.upper()}; then both gates of it",
        )
    return None


def _dead_switch(mean_A: complex) -> Finding:
    angle = cmath.phase(mean_A)
    ends = [(x, sign) for x in AXES for sign in (1, -1)]
    phase, sign = min(
        ends, key=lambda e: abs(_turned(angle - AXES[e[0]] - (0.0 if e[1] > 0 else math.pi)))
    )
    switch = "lower" if sign > 0 else "upper"
    half = "positive" if sign > 0 else "negative"
    return Finding(
        f"{switch} switch of leg {phase} does not turn on",
        f"phase {phase} carries current in the {half} direction only",
        f"check the gate signal, the driver's supply and the transistor: {switch} switch of leg "
        f"{phase.upper()}",
    )


def _turned(angle_rad: float) -> float:
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def crossed_gates(turn: Turn) -> tuple[str, Linear]:
    """Which legs the clamp says are driven by which duties: '' when each by its own."""
    direction = turn.clamp_A / abs(turn.clamp_A)
    axis = turn.hold_V / abs(turn.hold_V)
    return min(CROSSINGS.items(), key=lambda c: abs(c[1](axis) - direction))


def gates_finding(pair: str) -> Finding:
    return Finding(
        f"gates of legs {pair} exchanged",
        f"the clamp shows the currents of phases {pair} exchanged",
        "exchange the gate signals (both switches of each leg), not the motor's cables: the "
        "current sensors would then be wrong",
    )


def sensor_matrix(turn: Turn, legs: Linear) -> Linear:
    """S of the current sensors."""
    P, Q = turn.turning, turn.mirrored
    if legs.b:  # u = t conj(v): v's part comes from B
        P, Q = turn.mirrored / legs.b, turn.turning * legs.b
    else:
        P, Q = turn.turning / legs.a, turn.mirrored * legs.a
    lag = _lag(P, Q, turn.lag_rad)
    unscaled = Linear(P / lag, Q * lag)
    scale = abs(unscaled(turn.clamp_A)) / abs(turn.hold_A)  # |Y|
    return Linear(unscaled.a / scale, unscaled.b / scale)


def _lag(P: complex, Q: complex, predicted_rad: float) -> complex:
    """Of the current: as measured, if near the prediction, for gains are real; else predicted."""
    lag = cmath.exp(1j * predicted_rad)
    along = P / lag if (P / lag).real >= 0.0 else -P / lag
    if abs(P) > 0.25 * abs(Q) and abs(cmath.phase(along)) < LAG_OFF_RAD:
        lag *= along / abs(along)
    return lag


def current_sensors(S: Linear) -> Finding | None:
    """The fault of the current sensors that explains S; None: none."""
    for pair, crossing in CROSSINGS.items():
        if pair and S.off(crossing) < 2.0 * MATRIX_FIT:
            return _exchanged(pair)
    S = _straight(S)
    if abs(S.a - 1.0) < SCALE_OFF and abs(S.b) < GAIN_OFF / 3.0:
        return None
    if abs(S.b) < GAIN_OFF / 3.0 and abs(S.a.imag) < MATRIX_FIT:
        return _all_channels(S.a.real)
    found = {phase: _one_gain(S, phase) for phase in AXES}
    phase, (gain, off) = min(found.items(), key=lambda f: f[1][1])
    if off < MATRIX_FIT:
        return _channel(phase, gain)
    return _two_inverted(S) or Finding(
        "current sensors: more than one fault",
        f"the sensors show a = {S.a:.2f}, b = {S.b:.2f} of the current; 1 and 0 would be right",
        "check order, sign and scale of all three channels one by one, with a known current",
    )


def _straight(S: Linear) -> Linear:
    """Gains are real: what phase a has is lag."""
    along = S.a if S.a.real >= 0.0 else -S.a
    return S.turned_back(cmath.phase(along))


def _one_gain(S: Linear, phase: str) -> tuple[float, float]:
    """Gain of this channel alone, and how badly it explains S: a = 1 + (g-1)/3, b = (g-1)/3 e."""
    along = S.b * cmath.exp(-2j * AXES[phase])
    third = along.real
    return 1.0 + 3.0 * third, abs(S.a - 1.0 - third) + abs(along.imag)


def _two_inverted(S: Linear) -> Finding | None:
    other = Linear(-S.a, -S.b)
    phase, (gain, off) = min(
        {x: _one_gain(other, x) for x in AXES}.items(), key=lambda found: found[1][1]
    )
    if off > MATRIX_FIT or abs(gain + 1.0) > 0.3:
        return None
    pair = " and ".join(x for x in AXES if x != phase)
    return Finding(
        f"current sensors {pair} inverted",
        f"both channels {pair} have the wrong sign",
        "reverse both, or mirror the words in the port's read_adc",
    )


def _exchanged(pair: str) -> Finding:
    return Finding(
        f"current sensors {pair} exchanged",
        f"the drive reads the currents {pair} in each other's place; the clamp is right",
        "exchange the sensors' wires, or the ADC's channels in the port",
    )


def _all_channels(gain: float) -> Finding:
    if gain < 0.0:
        return Finding(
            "all current sensors inverted",
            "all three currents have the wrong sign",
            "positive is into the motor: mirror the words in the port's read_adc",
        )
    return Finding(
        f"all current sensors scaled by {gain:.2f}",
        f"the drive reads {gain:.2f} times what the clamp reads, on all three",
        f"divide current_full_scale_A by {gain:.2f}, or correct the amplifier",
    )


def _channel(phase: str, gain: float) -> Finding:
    if abs(gain) < 0.2:
        return Finding(
            f"current sensor {phase} dead",
            f"channel {phase} reads nothing while its cable carries current",
            f"check the sensor's supply and connector, and the ADC's channel of {phase.upper()}",
        )
    if gain < 0.0:
        return Finding(
            f"current sensor {phase} inverted",
            f"channel {phase} has the wrong sign" + (f" and scale {-gain:.2f}" * (gain < -1.3)),
            "turn the sensor round, or mirror its word in the port's read_adc",
        )
    return Finding(
        f"current sensor {phase} scaled by {gain:.2f}",
        f"channel {phase} reads {gain:.2f} times the true current, the other two are right",
        "compare shunt, burden resistor and gain of the three channels",
    )


def line_sensors(fit: Linear, predicted: complex) -> Finding | None:
    """Of the line voltages: sensed over applied voltage, against the prediction."""
    S = Linear(fit.a / predicted, fit.b / predicted.conjugate())
    columns = []
    for uv, vw in ((1.0, 0.0), (0.0, 1.0)):
        seen = S(_of_lines(uv, vw))
        columns.append((math.sqrt(1.5) * seen.real - seen.imag / math.sqrt(2.0),
                        math.sqrt(2.0) * seen.imag))  # fmt: skip
    (uv_uv, vw_uv), (uv_vw, vw_vw) = columns
    if abs(uv_uv) + abs(vw_vw) < 0.5 and min(abs(uv_vw), abs(vw_uv)) > 0.6:
        return Finding(
            "line-voltage sensors exchanged",
            "u_uv reads the voltage v-w and u_vw that of u-v",
            "exchange the two channels",
        )
    gains = {"u_uv": uv_uv, "u_vw": vw_vw}
    wrong = {name: gain for name, gain in gains.items() if abs(gain - 1.0) > LINE_OFF}
    crossed = max(abs(uv_vw), abs(vw_uv))
    if not wrong and crossed < 2.0 * LINE_OFF:
        return None
    if crossed > 0.3:
        return Finding(
            "line-voltage sensors wired to other lines",
            f"u_uv sees {uv_vw:.2f} of v-w, u_vw sees {vw_uv:.2f} of u-v",
            "check which terminals both sensors sit between",
        )
    if len(wrong) == 2 and abs(uv_uv - vw_vw) < LINE_OFF:
        return _line_gain("line-voltage sensors", uv_uv)
    name = max(wrong, key=lambda n: abs(wrong[n] - 1.0))
    return _line_gain(f"line-voltage sensor {name}", wrong[name])


def _line_gain(which: str, gain: float) -> Finding:
    if abs(gain) < 0.15:
        return Finding(f"{which} dead", "reads nothing", "check its supply and connector")
    if gain < 0.0:
        return Finding(f"{which} inverted", "has the wrong sign", "exchange its two wires")
    return Finding(
        f"{which} scaled by {gain:.2f}",
        f"reads {gain:.2f} times the voltage that is applied",
        "correct the divider, or line_voltage_full_scale_V when both are wrong alike",
    )


def _of_lines(uv_V: float, vw_V: float) -> complex:
    """Vector of two line voltages."""
    return complex(math.sqrt(2.0 / 3.0) * (uv_V + 0.5 * vw_V), vw_V / math.sqrt(2.0))
