"""A class in Python as the drive's estimator: host_sim/python_bridge calls back into it.

    class MyObserver:
        def init(self, params, motor): ...            coefficients; again after a live change
        def seed(self, i_s_A, lambda_r_Wb, omega_e_rad_s): ...
        def step(self, x: Sample) -> Estimate: ...    one period
        def hold(self, x: Sample, omega_e_rad_s) -> Estimate: ...  somebody else imposes the speed

One object is one motor from rest on: whenever the gates have been off, the next one begins.
Vectors are complex numbers of the stationary frame. What raises becomes NaN: the drive trips.
"""

from __future__ import annotations

import collections
import ctypes
import importlib.util
import inspect
import itertools
import os
import sys
import traceback
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, Structure, c_float, c_uint32
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, Protocol

from zerohertz import arguments
from zerohertz.build import PYTHON
from zerohertz.errors import UserError

VERBS = ("init", "seed", "step", "hold")
_IN, _SEED, _OUT = 11, 5, 8  # python_bridge.h
_MOST = 256  # objects kept: a process has a few drives, each with one object at a time
_FLOATS = POINTER(c_float)
_GIVEN, _SEEDED, _RESULT = (POINTER(c_float * n) for n in (_IN, _SEED, _OUT))


class Sample(NamedTuple):
    """One period: input of the estimator (estimator_in_t)."""

    u_s_V: complex  # mean over the interval that just ended
    i_s_A: complex  # sampled now
    expected_step_rad_s: float
    frame_imposed: bool
    omega_frame_rad_s: float
    dwell: float
    slip_extra_rad_s: float
    tau_extra_per_s: float


class Estimate(NamedTuple):
    """What an estimator returns (estimate_t)."""

    lambda_r_hat_Wb: complex
    omega_e_rad_s: float
    omega_s_rad_s: float
    i_residual_A: complex = 0j
    flux_correction_V: complex = 0j


class PythonEstimator(Protocol):
    """What a class has to have; params: every parameter by name; motor: as motor_model_t."""

    def init(self, params: Any, motor: Any) -> None: ...

    def seed(self, i_s_A: complex, lambda_r_Wb: complex, omega_e_rad_s: float) -> None: ...

    def step(self, x: Sample) -> Estimate: ...

    def hold(self, x: Sample, omega_e_rad_s: float) -> Estimate: ...


class _Table(Structure):
    _fields_ = (
        ("init", CFUNCTYPE(c_uint32, _FLOATS, c_uint32)),
        ("begin", CFUNCTYPE(c_uint32, c_uint32)),
        ("seed", CFUNCTYPE(None, c_uint32, _SEEDED, _RESULT)),
        ("step", CFUNCTYPE(None, c_uint32, c_uint32, _GIVEN, _RESULT)),
        ("hold", CFUNCTYPE(None, c_uint32, c_uint32, _GIVEN, _RESULT)),
    )


_used: type[PythonEstimator] | None = None  # by use(); workers find it by its file
_kept: list[_Table] = []  # the library keeps the address


def use(made: type[PythonEstimator]) -> None:
    """This class for every drive of this process and its workers, before the first one."""
    global _used
    from zerohertz.estimators import chosen

    if not isinstance(made, type):
        arguments.refuse("use", "made", made, "a class with init, seed, step and hold")
    _checked(made, made.__name__)
    try:
        file = inspect.getfile(made)
    except (OSError, TypeError):
        raise UserError(
            f"use: made: {made.__name__} stands in no file; write it to one and import it"
        ) from None
    chosen.choose(f"{file}:{made.__name__}")
    _used = made


def register(lib: ctypes.CDLL) -> None:
    """Hand the functions of the chosen class to a library that has the bridge."""
    made = _used or _loaded(os.environ[PYTHON])
    bridge = _Bridge(made, _names(lib))
    table = _Table(
        **{
            name: kind(function)
            for (name, kind), function in zip(_Table._fields_, bridge.functions(), strict=True)
        }
    )
    _kept.append(table)
    lib.zh_python_bridge_register.argtypes = (ctypes.c_void_p,)
    lib.zh_python_bridge_register.restype = None
    lib.zh_python_bridge_register(ctypes.addressof(table))


def _names(lib: ctypes.CDLL) -> list[str]:
    return [lib.zh_sil_name(k).decode() for k in range(lib.zh_sil_name_count())]


def _loaded(spec: str) -> type[PythonEstimator]:
    file, _, name = spec.rpartition(":")
    found = importlib.util.spec_from_file_location(Path(file).stem, file)
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    try:
        found.loader.exec_module(module)
    except Exception as error:
        raise UserError(f"{file}: {type(error).__name__}: {error}") from None
    made = getattr(module, name, None)
    if made is None:
        raise UserError(f"{file}: has no class '{name}'; correct FILE.py:CLASS")
    return _checked(made, f"{file}: {name}")


def _checked(made: type[PythonEstimator], where: str) -> type[PythonEstimator]:
    """UserError with what is expected when a function is missing or takes something else."""
    for verb in VERBS:
        wanted = inspect.signature(getattr(PythonEstimator, verb))
        there = getattr(made, verb, None)
        expected = f"expected: def {verb}{wanted}"
        if there is None:
            raise UserError(f"{where}: has no {verb}; {expected}")
        try:
            inspect.signature(there).bind(*range(len(wanted.parameters)))
        except TypeError:
            raise UserError(f"{where}: {verb}{inspect.signature(there)}; {expected}") from None
    return made


class _Bridge:
    """The class, its parameter sets and its objects by their numbers."""

    def __init__(self, made: type[PythonEstimator], names: list[str]) -> None:
        self._made, self._names = made, names
        self._sets: dict[bytes, int] = {}
        self._numbers: dict[int, tuple[SimpleNamespace, SimpleNamespace]] = {}
        self._objects: collections.OrderedDict[int, list[Any]] = collections.OrderedDict()
        self._next = itertools.count(1)
        self._told = False

    def functions(self) -> tuple[Callable[..., Any], ...]:
        return (self._init, self._begin, self._seed, self._step, self._hold)

    def _init(self, values: Any, count: int) -> int:
        """The same numbers have the same name: a configuration is compared byte for byte."""
        try:
            listed = values[:count]
            key = bytes(memoryview((c_float * count)(*listed)))
            if key not in self._sets:
                params = SimpleNamespace(**dict(zip(self._names, listed, strict=True)))
                motor = motor_model(params)
                self._made().init(params, motor)
                number = len(self._sets) + 1
                self._sets[key], self._numbers[number] = number, (params, motor)
            return self._sets[key]
        except Exception:
            self._tell()
            return 0

    def _begin(self, numbers: int) -> int:
        number = next(self._next)
        made = self._made()
        made.init(*self._numbers[numbers])
        self._objects[number] = [made, numbers]
        if len(self._objects) > _MOST:
            self._objects.popitem(last=False)
        return number

    def _object(self, number: int, numbers: int) -> PythonEstimator:
        entry = self._objects[number]
        if entry[1] != numbers:
            entry[0].init(*self._numbers[numbers])
            entry[1] = numbers
        return entry[0]

    def _seed(self, number: int, given: Any, out: Any) -> None:
        i_a, i_b, flux_a, flux_b, omega = given.contents
        flux = complex(flux_a, flux_b)
        try:
            self._objects[number][0].seed(complex(i_a, i_b), flux, omega)
            _write(out, Estimate(flux, omega, omega))
        except Exception:
            self._fail(out)

    def _step(self, number: int, numbers: int, given: Any, out: Any) -> None:
        try:
            x, _ = _sample(given)
            _write(out, self._object(number, numbers).step(x))
        except Exception:
            self._fail(out)

    def _hold(self, number: int, numbers: int, given: Any, out: Any) -> None:
        try:
            x, omega_e_rad_s = _sample(given)
            _write(out, self._object(number, numbers).hold(x, omega_e_rad_s))
        except Exception:
            self._fail(out)

    def _fail(self, out: Any) -> None:
        out.contents[:] = [float("nan")] * _OUT
        self._tell()

    def _tell(self) -> None:
        """Once: a campaign would repeat it a million times."""
        if not self._told:
            self._told = True
            traceback.print_exc()
            print(f"{self._made.__name__}: raised; the drive gets NaN from it", file=sys.stderr)


def _sample(given: Any) -> tuple[Sample, float]:
    ua, ub, ia, ib, expected, imposed, frame, dwell, slip, tau, omega = given.contents
    x = Sample(complex(ua, ub), complex(ia, ib), expected, imposed > 0.5, frame, dwell, slip, tau)
    return x, omega


def _write(out: Any, e: Estimate) -> None:
    flux, omega_e, omega_s, residual, correction = e
    out.contents[:] = (
        *(flux.real, flux.imag, residual.real, residual.imag),
        *(correction.real, correction.imag, omega_e, omega_s),
    )


def motor_model(p: SimpleNamespace) -> SimpleNamespace:
    """Derived quantities of the machine, as motor_model_t of firmware/law/base/motor.h."""
    sigma_Ls_H = p.Ls_H - p.M_H**2 / p.Lr_H
    return SimpleNamespace(
        Rs_ohm=p.Rs_ohm,
        M_H=p.M_H,
        sigma_Ls_H=sigma_Ls_H,
        tau_per_s=p.Rr_ohm / p.Lr_H,
        kr=p.M_H / p.Lr_H,
        pole_pairs=p.pole_pairs,
    )
