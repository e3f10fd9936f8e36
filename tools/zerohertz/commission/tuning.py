"""Every parameter of the firmware and of its gain table from motor, plate and period.

Time constants are those of the motor. What a loop's pole is in units of them was chosen once, on
the recommended configuration of Table 1's machine (host_sim/configs/README.md), and holds for all.
"""

from __future__ import annotations

import math

from zerohertz.commission.plate import Plate, threshold_A
from zerohertz.commission.solve import Identified
from zerohertz.errors import UserError
from zerohertz.motor import MAX_ENTRIES, STEP_ELEC_PER_MIN, Circuit, Design

# Observer: real poles p1 and -(a Rr/Lr + b |w|); p1 over the motor's own current decay a11.
P1_SLOW, P1_FAST = 1.1, 2.25
P2_A, P2_B = 0.87, 0.8
# p1 goes from slow to fast between these speeds, in units of the slow p1.
P1_FROM, P1_TO = 0.2, 0.6
# Adaptation: s^2 + (|p1| + g kp) s + g ki, g = lambda^2 kr/(sigma Ls) from speed to lambda e1_q.
ADAPT_OMEGA, ADAPT_DAMPING = 1.33, 0.892
# Adaptation and speed loop take a slower pole for one of this. 37 and 75 kW have 100 and 92, half
# of Table 1's. With loops that slow a load step threw light shafts (zh envelope, 39 of 3900032313
# and 7 of 3973734054). With 190 both are held as well, but another run ends in a false trip.
LEAST_POLE_PER_S = 150.0
# Speed loop: inside the adaptation; what a large inertia would take is bounded by the firmware.
SPEED_SLOW, SPEED_FAST = 0.37, 0.72
SPEED_FROM = 0.134
# Share of the expected acceleration that the speed estimate is fed. The load is known with the
# speed loop's delay; the error that this leaves goes with (acceleration / a11^2)^2. A motor whose
# acceleration at rated torque is more than ACCEL a11^2 is fed that much less.
ACCEL_SHARE, ACCEL = 0.7, 0.25
# Sensed voltage up to this share of rated frequency, the duty from twice that on.
BLEND = 1.0 / 30.0
# Field weakening begins below the largest voltage by as much.
WEAKEN = 0.93
# Rs tracking: an error dRs leaves a residual of about dRs i_q/(w_s M); the same rate for all.
RS_BIAS, TRACK_PER_H = 1.02, 2.94
# Steering: least stator frequency over that at which rated current drops the rotor's EMF at Rs.
STEER, STEER_FLUX = 0.196, 0.39
# Dwell where steering cannot act: share of the speed, or of 1/Tr below that, that it swings by.
DWELL_SPEED, DWELL = 1, 0.2
I_F = 0.95  # of the largest current: I-f operation after a lost orientation
# Current loop: a quarter of what the delay of 1.5 periods leaves would be 830 rad/s at 200 us. A
# shorter period makes it no faster: with a leakage that is less than told, the estimate takes each
# change of the torque current for a change of speed, and the speed loop swings at 60 to 80 Hz.
CURRENT_PERIODS, CURRENT_RAD_S = 0.12, 600.0
OVERLOAD = 1.5
CONTINUOUS = 1.05  # of rated current: plates are rounded
TRIP = 1.3
# Protection, as host_sim/configs/recommended.toml has it for Table 1's motor. Open phase: over i_d,
# which flows without load as well. The residual: over the largest current, as the trip is, so that
# it stays below it. Power: over rated. Stall: a hundred times the motor's inertia has left
# standstill by then, whatever the motor.
OPEN_PHASE, RESIDUAL, POWER, STALL_S = 0.235, 0.75, 0.5, 2.0
MAGNETISE = 0.9  # of the current limit at most: the rest is for torque
PEAK = math.sqrt(2.0 / 3.0)  # phase current of a vector
# Rs is measured at this share of rated current and at .625 of it. While the dead time charges the
# legs' capacitance C, their loss still grows with the current, by u^2 C/(T i^2) per ampere: at a
# share of .7 and 62.5 us that was as much as the Rs of a motor of 15 kW.
RS_LEVEL = 1.0
RANGE = 1.2  # of rated frequency
DEVIATION = 0.05  # of rated speed: a shaft that is further off for a second counts as harm
MARGIN = 0.7  # share of rated torque that the ramp takes
DUTY = 1  # voltage_source


def poles_per_s(circuit: Circuit) -> tuple[float, float]:
    """|p1| at low speed and at speed."""
    return P1_SLOW * circuit.a11_per_s, P1_FAST * circuit.a11_per_s


def design_of(circuit: Circuit, plate: Plate, period_s: float) -> Design:
    """What the gain table is designed for."""
    slow, fast = poles_per_s(circuit)
    elec_per_min = 60.0 / (2.0 * math.pi)
    largest = (MAX_ENTRIES - 1) * STEP_ELEC_PER_MIN
    end = 2 * round(RANGE * 60.0 * plate.frequency_Hz / 2)
    return Design(
        method="closed_form",
        dw0_rad_s=round(0.6 * circuit.tau_per_s, 6),
        radius_per_s=round(max(1500.0, 2.0 * fast), 3),
        decay_per_s=round(min(1.0, 0.2 * circuit.tau_per_s), 6),
        relax=1.05,
        period_s=period_s,
        table_end_elec_per_min=min(end, largest),
        p1_per_s=round(-slow, 3),
        a=P2_A,
        b=P2_B,
        p1_fast_per_s=round(-fast, 3),
        p1_slow_elec_per_min=round(P1_FROM * slow * elec_per_min, 3),
        p1_fast_elec_per_min=round(P1_TO * slow * elec_per_min, 3),
    )


def firmware_parameters(
    motor: Identified,
    plate: Plate,
    J_kg_m2: float,
    period_s: float,
    i_trip_max_A: float = math.inf,
) -> dict[str, float]:
    """Bandwidths from time constants, limits from rated current, flux from rated voltage.

    What follows from the board alone (full scales, dc-link limits) stays as the board gives it.
    """
    circuit, flux = motor.circuit, motor.rotor_flux_Wb
    return {
        **_estimator(circuit, plate, flux),
        **_speed(circuit, plate, J_kg_m2),
        **_currents(motor, plate, i_trip_max_A),
        **_protection(motor, plate, i_trip_max_A),
        **_start(circuit, plate, i_trip_max_A),
        "current_bandwidth_rad_s": min(CURRENT_PERIODS / period_s, CURRENT_RAD_S),
        "lambda_max_Wb": 4.0 * flux,
        "dead_time_i_threshold_A": threshold_A(plate),
        **_orientation(circuit, plate, flux),
        # Orientation lost: I-f operation takes over.
        "lost_action": 2,
        "i_f_A": I_F * limit_A(plate, i_trip_max_A),
    }


def _orientation(circuit: Circuit, plate: Plate, flux_Wb: float) -> dict[str, float]:
    """What keeps the field where it is believed to be, near zero stator frequency and beyond."""
    drop_rad_s = circuit.Rs_ohm * plate.current_vector_A / flux_Wb
    return {
        "voltage_source": 2,
        "voltage_blend_Hz": BLEND * plate.frequency_Hz,
        "weaken_share": WEAKEN,
        "rs_bias": RS_BIAS,
        "rs_track_gain": TRACK_PER_H * circuit.M_H,
        "offset_track": 1,
        "steer_min_Hz": STEER * drop_rad_s / (2.0 * math.pi),
        "steer_flux_min": STEER_FLUX,
        "dwell": DWELL_SPEED,
        "dwell_amplitude": DWELL,
    }


def _pace_per_s(slow_per_s: float) -> float:
    """The pole that adaptation and speed loop go by, of a motor whose slow pole this is."""
    return max(slow_per_s, LEAST_POLE_PER_S)


def _estimator(circuit: Circuit, plate: Plate, flux_Wb: float) -> dict[str, float]:
    slow, _ = poles_per_s(circuit)
    g = flux_Wb**2 * circuit.M_H / circuit.Lr_H / circuit.sigma_Ls_H
    omega = ADAPT_OMEGA * _pace_per_s(slow)
    return {
        "observer_method": 1,
        "adapt_ki": omega**2 / g,
        "adapt_kp": (2.0 * ADAPT_DAMPING * omega - slow) / g,
        "phi_factor": 0.576,
        "omega_max_rad_s": 1.3 * RANGE * plate.omega_rad_s,
        "speed_max_rad_s": 1.1 * RANGE * plate.omega_rad_s,
        "over_speed_rad_s": 1.25 * RANGE * plate.omega_rad_s,
        "speed_deviation_rad_s": DEVIATION * plate.pole_pairs * plate.speed_rpm * math.pi / 30.0,
    }


def _speed(circuit: Circuit, plate: Plate, J_kg_m2: float) -> dict[str, float]:
    slow, _ = poles_per_s(circuit)
    pace = _pace_per_s(slow)
    slew = MARGIN * plate.torque_Nm / J_kg_m2 * plate.pole_pairs
    return {
        "speed_bandwidth_rad_s": SPEED_SLOW * pace,
        "speed_fast_bandwidth_rad_s": SPEED_FAST * pace,
        "speed_slow_rad_s": SPEED_FROM * slow,
        "speed_ki_factor": 0.12,
        "adapt_accel_share": _accel_share(circuit, plate, J_kg_m2),
        "speed_filter_s": 0.0005,
        "speed_J_kg_m2": J_kg_m2,
        "speed_slew_rad_s2": slew,
        "ramp_down_rad_s2": 0.5 * slew,  # friction helps, and the dc link takes less
    }


def _accel_share(circuit: Circuit, plate: Plate, J_kg_m2: float) -> float:
    accel_rad_s2 = plate.torque_Nm / J_kg_m2 * plate.pole_pairs
    return ACCEL_SHARE * min(1.0, ACCEL * circuit.a11_per_s**2 / accel_rad_s2) ** 2


def limit_A(plate: Plate, i_trip_max_A: float) -> float:
    """Largest current vector: overload, or what the trip of the board leaves room for."""
    return min(OVERLOAD * plate.current_vector_A, i_trip_max_A / (TRIP * PEAK))


def _currents(motor: Identified, plate: Plate, i_trip_max_A: float) -> dict[str, float]:
    most_A = limit_A(plate, i_trip_max_A)
    if motor.i_d_A > MAGNETISE * most_A:
        raise UserError(
            f"rated flux takes {motor.i_d_A * PEAK:.3g} A at the peak of a phase, and the current "
            f"limit is {most_A * PEAK:.3g} A; raise the limit, or take a board for more current"
        )
    return {
        "i_d_A": motor.i_d_A,
        "i_d_max_A": min(1.5 * motor.i_d_A, most_A),
        "i_max_A": most_A,
        "i_q_max_A": math.sqrt(most_A**2 - motor.i_d_A**2),
        "overload_motor_A": min(CONTINUOUS * plate.current_vector_A, most_A),
        "i_trip_A": TRIP * PEAK * most_A,
    }


def _protection(motor: Identified, plate: Plate, i_trip_max_A: float) -> dict[str, float]:
    """What else would be off: open phase, estimate, stall."""
    return {
        "open_phase_A": OPEN_PHASE * motor.i_d_A,
        "observer_e1_A": RESIDUAL * limit_A(plate, i_trip_max_A),
        "observer_power_W": POWER * 1e3 * plate.power_kW,
        "stall_s": STALL_S,
    }


def _start(circuit: Circuit, plate: Plate, i_trip_max_A: float) -> dict[str, float]:
    """Rs and the inverter's loss are measured again at every start: the winding is warm or cold."""
    settle_s = min(max(6.0 / circuit.tau_per_s, 0.3), 15.0)
    return {
        "rs_measure": 1,
        "dead_time_identify": 2,
        "rs_high_A": RS_LEVEL * min(plate.current_vector_A, limit_A(plate, i_trip_max_A)),
        "rs_level_s": settle_s,
        "premagnetise_s": settle_s,
    }
