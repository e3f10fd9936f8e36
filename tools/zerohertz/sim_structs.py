"""The structs of host_sim/sim.h, field by field."""

from __future__ import annotations

from ctypes import POINTER, Structure, c_char_p, c_double, c_float, c_uint32, c_uint64, c_void_p

from zerohertz.sil_types import RawCommissioning


class RawJob(Structure):
    """zh_sim_job"""

    _fields_ = (
        ("struct_size", c_uint32),
        ("flags", c_uint32),
        ("decimate", c_uint32),
        ("gain_entries", c_uint32),
        ("seed", c_uint64),
        ("max_steps", c_uint64),
        ("scenario", c_char_p),
        ("rig", c_char_p),
        ("board", c_char_p),
        ("motor_dir", c_char_p),
        ("scenario_overrides", c_char_p),
        ("rig_overrides", c_char_p),
        ("board_overrides", c_char_p),
        ("firmware_config", c_char_p),
        ("firmware", c_char_p),
        ("gain", POINTER(c_float)),
        ("columns", c_uint64),
    )


class RawResult(Structure):
    """zh_sim_result"""

    _fields_ = (
        ("struct_size", c_uint32),
        ("columns", c_uint32),
        ("rows", c_uint64),
        ("stride", c_uint64),
        ("data", POINTER(c_float)),
        ("steps", c_uint64),
        ("period_s", c_double),
        ("trip", c_uint32),
        ("first_fault", c_uint32),
        ("trip_s", c_double),
        ("first_fault_s", c_double),
        ("loop_ns_per_step", c_double),
        ("controller_ns_per_step", c_double),
        ("plant_ns_per_step", c_double),
        ("owner", c_void_p),
        ("signal_hashes", POINTER(c_uint64)),
        ("commissioning", RawCommissioning),
    )
