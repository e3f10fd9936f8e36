"""The FMUs of `zh fmu` in FMPy: valid, complete, and the drive of zerohertz.Drive bit for bit."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zerohertz.drive import Drive
from zerohertz.plant import Plant
from zerohertz.release.fmu import HEADERS, build_fmus
from zerohertz.scenario.setup import load_setup

fmpy = pytest.importorskip("fmpy")
from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402

PERIODS, T_S = 30_000, 200e-6
SETUP = load_setup("recommended")
WORDS = ("i_u", "i_v", "i_w", "u_uv", "u_vw", "u_dc")
DUTIES = ("duty_u", "duty_v", "duty_w", "speed_hat_rpm", "lambda_Wb", "i_q_A")
NAMES = [f"{unit}_fmi{v}" for unit in ("zerohertz_drive", "zerohertz_drive_plant") for v in (2, 3)]
DRIVES, PLANTS = NAMES[:2], NAMES[2:]


def speed_ref_rpm(k: int) -> float:
    return 60.0 if k < 27_500 else -60.0  # the start takes 5 s


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made = build_fmus(tmp_path_factory.mktemp("fmu"), "recommended")
    return {path.stem: path for path in made}


class Unit:
    """One instance of an FMU, version 2 or 3 by the same names."""

    def __init__(self, path: Path, folder: str) -> None:
        told = fmpy.read_model_description(path)
        self.reference = {v.name: v.valueReference for v in told.modelVariables}
        self.version = int(told.fmiVersion[0])
        kind = FMU2Slave if self.version == 2 else FMU3Slave
        self.slave = kind(
            guid=told.guid,
            unzipDirectory=folder,
            modelIdentifier=told.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.slave.instantiate()

    def start(self, **values: float) -> None:
        if self.version == 2:
            self.slave.setupExperiment(startTime=0.0)
            self.slave.enterInitializationMode()
        else:
            self.slave.enterInitializationMode(startTime=0.0)
        self.reals(**values)
        self.slave.exitInitializationMode()

    def reals(self, **values: float) -> None:
        references = [self.reference[name.replace("__", ".")] for name in values]
        put = self.slave.setReal if self.version == 2 else self.slave.setFloat64
        put(references, list(values.values()))

    def words(self, words: Any) -> None:
        put = self.slave.setInteger if self.version == 2 else self.slave.setUInt32
        put([self.reference[name] for name in WORDS], [int(word) for word in words])

    def flags(self, **values: bool) -> None:
        self.slave.setBoolean([self.reference[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        get = self.slave.getReal if self.version == 2 else self.slave.getFloat64
        return get([self.reference[name] for name in names])

    def step(self, k: int, periods: int = 1) -> None:
        self.slave.doStep(k * T_S, periods * T_S)


@contextmanager
def unit(path: Path, tmp_path: Path) -> Iterator[Unit]:
    made = Unit(path, fmpy.extract(path, tmp_path / path.stem))
    try:
        yield made
    finally:
        made.slave.terminate()
        made.slave.freeInstance()


@pytest.fixture(scope="module")
def recorded() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of drive and plant: the words, what the drive made of them, the true speed afterwards."""
    words = np.empty((PERIODS, 6), np.uint16)
    out, speed_rpm = np.empty((PERIODS, len(DUTIES))), np.empty(PERIODS)
    with (
        Drive(SETUP.motor_dir, SETUP.board, SETUP.params) as drive,
        Plant(SETUP.rig, SETUP.board, seed=1) as plant,
    ):
        for k in range(PERIODS):
            words[k] = plant.sample()
            now = drive.step(*words[k].tolist(), speed_ref_rpm=speed_ref_rpm(k), run=k >= 1000)
            plant.advance((now.duty_u, now.duty_v, now.duty_w), now.gates_on)
            out[k] = [getattr(now, name) for name in DUTIES]
            speed_rpm[k] = plant.truth().speed_rpm
    return words, out, speed_rpm


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_no_problem(fmus: dict[str, Path], name: str) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(fmus[name]) == []


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_simulates_it_by_its_own_loop(fmus: dict[str, Path], name: str) -> None:
    """As a user's first command does, who knows nothing of the unit but its start values."""
    quick = {"parameter.adapt_kp": 5.0, "run": True}
    watched = ["duty_u", "duty_v", "duty_w"]
    found = fmpy.simulate_fmu(
        fmus[name],
        stop_time=1.0,
        output_interval=50 * T_S,
        start_values=quick,
        output=watched,
    )
    assert len(found) == 101
    duties = np.column_stack([found[name] for name in watched])
    assert ((duties >= 0.0) & (duties <= 1.0)).all()
    if name in PLANTS:  # without a plant no current comes, and its words stand still
        assert np.ptp(duties[-20:]) > 0.01


@pytest.mark.parametrize("name", NAMES)
def test_every_function_of_the_standard_resolves(
    fmus: dict[str, Path], name: str, tmp_path: Path
) -> None:
    header = (HEADERS / f"fmi{name[-1]}Functions.h").read_text()
    if name.endswith("2"):  # there, model exchange is an interface of its own
        exchange = header.rindex("Functions for FMI2 for Model Exchange")
        header = header[:exchange] + header[header.rindex("Functions for FMI2 for Co-Sim") :]
    functions = re.findall(r"FMI[23]_Export\s+fmi\w+TYPE\s+(fmi\w+);", header)
    fmpy.extract(fmus[name], tmp_path)
    library = ctypes.CDLL(str(next(tmp_path.rglob("*.so"))))
    assert len(functions) > 30
    assert [function for function in functions if not hasattr(library, function)] == []


@pytest.mark.parametrize("name", DRIVES)
def test_the_drive_gives_the_bits_of_the_binding(
    fmus: dict[str, Path], name: str, tmp_path: Path, recorded: tuple[np.ndarray, ...]
) -> None:
    words, expected, _ = recorded
    found = np.empty_like(expected)
    with unit(fmus[name], tmp_path) as drive:
        drive.start()
        drive.flags(adc_words=True)
        for k in range(PERIODS):
            drive.words(words[k])
            if k in (0, 27_500):
                drive.reals(speed_ref_rpm=speed_ref_rpm(k))
            if k == 1000:
                drive.flags(run=True)
            drive.step(k)
            found[k] = drive.get(*DUTIES)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", PLANTS)
def test_drive_and_plant_give_the_bits_of_the_bindings(
    fmus: dict[str, Path], name: str, tmp_path: Path, recorded: tuple[np.ndarray, ...]
) -> None:
    _, expected, speed_rpm = recorded
    with unit(fmus[name], tmp_path) as both:
        both.start()
        for k in range(0, PERIODS, 5):  # a step of several periods is those periods
            both.reals(speed_ref_rpm=speed_ref_rpm(k))
            both.flags(run=k >= 1000)
            both.step(k, 5)
            assert both.get(*DUTIES) == pytest.approx(expected[k + 4], abs=0.0, nan_ok=True)
            assert both.get("plant.speed_rpm") == [speed_rpm[k + 4]]
    assert max(speed_rpm) > 55.0  # it did run
    assert min(speed_rpm) < -55.0


def test_two_instances_share_nothing(fmus: dict[str, Path], tmp_path: Path) -> None:
    path = fmus["zerohertz_drive_plant_fmi3"]
    with unit(path, tmp_path) as one, unit(path, tmp_path / "other") as other:
        for made, reference in ((one, 120.0), (other, -120.0)):
            made.start()
            made.reals(speed_ref_rpm=reference)
            made.step(0, 1000)
            made.flags(run=True)
        for k in range(1000, 27_000, 100):  # the shaft starts after 24 800
            one.step(k, 100)
            other.step(k, 100)
        assert one.get("plant.speed_rpm")[0] == pytest.approx(120.0, abs=5.0)
        assert other.get("plant.speed_rpm")[0] == pytest.approx(-120.0, abs=5.0)


@pytest.mark.parametrize("name", NAMES)
def test_a_state_and_a_reset_lead_back(fmus: dict[str, Path], name: str, tmp_path: Path) -> None:
    asked = ["duty_u", "duty_v", "duty_w", "parameter.adapt_kp"]

    def go(made: Unit, begin: int, periods: int) -> list[list[float]]:
        rows = []
        for k in range(begin, begin + periods):
            made.step(k)
            rows.append(made.get(*asked))
        return rows

    with unit(fmus[name], tmp_path) as made:
        made.start(parameter__adapt_kp=5.0)
        first = go(made, 0, 1000)
        made.flags(run=True)
        first += go(made, 1000, 1500)
        assert first[-1] != first[0]  # the gates are on
        state = made.slave.getFMUState()
        ahead = go(made, 2500, 500)
        made.reals(parameter__adapt_kp=6.0)
        made.slave.setFMUState(state)
        assert go(made, 2500, 500) == ahead
        made.slave.freeFMUState(state)
        made.slave.reset()
        assert made.get("parameter.adapt_kp") != [5.0]
        made.start(parameter__adapt_kp=5.0)
        again = go(made, 0, 1000)
        made.flags(run=True)
        assert again + go(made, 1000, 1500) == first


@pytest.mark.parametrize("name", DRIVES)
def test_a_state_can_be_carried_away(fmus: dict[str, Path], name: str, tmp_path: Path) -> None:
    with unit(fmus[name], tmp_path) as one, unit(fmus[name], tmp_path / "other") as other:
        for made in (one, other):
            made.start()
        one.reals(i_u_A=1.0, i_v_A=-0.5, i_w_A=-0.5, u_dc_V=283.0)
        one.step(0, 900)
        state = one.slave.getFMUState()
        data = one.slave.serializeFMUState(state)
        other.slave.setFMUState(other.slave.deserializeFMUState(data))
        one.step(900, 100)
        other.step(900, 100)
        assert one.get(*DUTIES) == pytest.approx(other.get(*DUTIES), abs=0.0, nan_ok=True)
        with pytest.raises(Exception, match="rror"):
            other.slave.deserializeFMUState(data[:-1])


@pytest.mark.parametrize("name", DRIVES)
def test_what_is_refused_is_an_error_of_the_standard(
    fmus: dict[str, Path], name: str, tmp_path: Path
) -> None:
    with unit(fmus[name], tmp_path) as drive:
        with pytest.raises(Exception, match="rror"):
            drive.start(parameter__adapt_kp=-1.0)
        drive.slave.reset()
        drive.start()
        with pytest.raises(Exception, match="rror"):
            drive.reals(duty_u=0.2)
