"""What runs behind the page on this computer: commissioning, table design, saving, a trial.

One job at a time and one recording beside it, each in a thread and one more client of the broker.
Events for the page are objects with `job` and one of `say`, `share`, `result`, `error`.
"""

from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from zerohertz.errors import UserError
from zerohertz.link.client import Client
from zerohertz.link.line import Line
from zerohertz.paths import BUILD, INSTALLED, ROOT
from zerohertz.studio.flights import Flights

if TYPE_CHECKING:
    from zerohertz.commission.finding import Finding

FOLDER = BUILD / "studio"
_NAME = "motor"
_POINTS = 1000  # of a trial's picture
Tell = Callable[[dict[str, Any]], None]


class Tools:
    """The jobs, and what they found."""

    def __init__(self, dial: Callable[[], Line], key: bytes, rig: Path | None = None) -> None:
        self._dial, self._key, self._rig = dial, key, rig
        self._found: Finding | None = None
        self._busy = threading.Lock()
        self._cancel = threading.Event()
        self._flights = Flights(self._drive, FOLDER)
        self._recording = threading.Lock()
        self._jobs: dict[str, Callable[[dict[str, Any], Tell], object]] = {
            "commission": self._commission,
            "design": self._design,
            "keep": self._keep,
            "trial": self._trial,
            "flight": self._flight,
        }

    @property
    def offer(self) -> dict[str, object]:
        """What the page can ask for; the nameplate of a simulated motor is known."""
        plate = None
        if self._rig is not None:
            from zerohertz.commission.plate import read_plate

            plate = dataclasses.asdict(read_plate(self._rig))
        return {"plate": plate, "trial": self._rig is not None}

    def begin(self, asked: dict[str, Any], tell: Tell) -> None:
        """Starts the job that the page names; `cancel` ends the one that runs."""
        name = str(asked["do"])
        if name == "cancel":
            self._cancel.set()
            return
        if name == "flight_end":
            self._flights.cancel()
            return
        job = self._jobs[name]
        threading.Thread(target=self._run, args=(name, job, asked, tell), daemon=True).start()

    def abandon(self) -> None:
        """The page has gone: nobody watches a motor that is being measured."""
        self._cancel.set()
        self._flights.cancel()

    def _run(
        self, name: str, job: Callable[[dict[str, Any], Tell], object], asked: Any, tell: Tell
    ) -> None:
        def event(content: dict[str, Any]) -> None:
            tell({"job": name} | content)

        lock = self._recording if name == "flight" else self._busy
        if not lock.acquire(blocking=False):
            event({"error": "something else is going on; wait for it or cancel it"})
            return
        try:
            if lock is self._busy:
                self._cancel.clear()
            event({"result": job(asked, event)})
        except (UserError, TypeError) as error:
            event({"error": str(error)})
        finally:
            lock.release()

    def _pause(self, seconds: float) -> None:
        time.sleep(seconds)
        if self._cancel.is_set():
            self._cancel.clear()  # what follows puts the drive's parameters back
            raise UserError("cancelled")

    def _drive(self) -> Client:
        drive = Client(self._dial(), timeout_s=1.0, key=self._key)
        drive.introduce("studio tools")
        drive.unlock(self._key)
        return drive

    def _commission(self, asked: dict[str, Any], event: Tell) -> object:
        from zerohertz.commission import finding
        from zerohertz.commission.plate import plate_from, warnings

        plate = plate_from(asked["plate"], "the nameplate")
        for doubt in warnings(plate):
            event({"say": f"check the nameplate: {doubt}"})
        with self._drive() as drive:
            found = finding.of_drive(
                drive,
                _NAME,
                plate,
                lambda text: event({"say": text}),
                rotate=bool(asked.get("rotate", False)),
                pause=self._pause,
            )
        if found.motor is None:
            raise UserError(f"the drive refuses what it found: {found.refusal}")
        self._found = found
        FOLDER.mkdir(parents=True, exist_ok=True)
        found.write(FOLDER / _NAME)
        return _told(found)

    def _design(self, _: dict[str, Any], event: Tell) -> object:
        from zerohertz.gain_design.stored import JSON_NAME
        from zerohertz.gain_design.table import design_table, table_json
        from zerohertz.motor import load_motor

        self._required()
        _fetch_solver(event)
        motor = load_motor(FOLDER / _NAME)

        def progress(done: int) -> None:
            if self._cancel.is_set():
                raise UserError("cancelled")
            event({"share": done / motor.design.entries})

        table = design_table(motor, progress=progress)
        (FOLDER / _NAME / JSON_NAME).write_text(table_json(table), encoding="utf-8")
        known = [gamma for gamma in table.gamma if gamma is not None]
        return {
            "entries": motor.design.entries,
            "method": motor.design.method,
            "gamma": max(known) if len(known) == motor.design.entries else None,
            "folder": str(FOLDER / _NAME),
        }

    def _keep(self, _: dict[str, Any], event: Tell) -> object:
        from zerohertz.commission import board_run

        found = self._required()
        assert found.motor is not None
        event({"say": "setting the parameters, then saving them"})
        with self._drive() as drive:
            values = board_run.keep(drive, found.motor, found.plate, found.board)
        return {"parameters": len(values)}

    def _trial(self, _: dict[str, Any], event: Tell) -> object:
        from zerohertz.commission.trial import run_trial

        self._required()
        if self._rig is None:
            raise UserError("the trial needs the simulated motor: zh studio --rig NAME")
        event({"say": "simulating a speed step, then rated load on and off"})
        seen = run_trial(FOLDER / _NAME, self._rig)
        step = max(len(seen.record.t_s) // _POINTS, 1)
        answer = {f.name: getattr(seen, f.name) for f in dataclasses.fields(seen)}
        answer["record"] = {
            "t": seen.record.t_s[::step].tolist(),
            "speed_rpm": seen.record["speed_rpm"][::step].tolist(),
            "speed_ref_rpm": seen.record["speed_ref_rpm"][::step].tolist(),
        }
        return answer

    def _flight(self, _: dict[str, Any], event: Tell) -> object:
        return self._flights.record(lambda text: event({"say": text}))

    def _required(self) -> Finding:
        if self._found is None:
            raise UserError("no motor has been found yet; begin with the nameplate")
        return self._found


def _fetch_solver(event: Tell) -> None:
    """`zh studio` starts without the solver; the first design brings it."""
    if importlib.util.find_spec("clarabel") is not None:
        return
    if INSTALLED:
        raise UserError("the solver is not installed; run pip install 'zerohertz[design]'")
    event({"say": "fetching the solver: 37 MB, 148 MB on disk"})
    done = subprocess.run(
        [ROOT / "tools" / "zh", "setup", "design"], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise UserError(f"the solver could not be fetched: {done.stderr.strip()[-300:]}")
    importlib.invalidate_caches()


def _told(found: Finding) -> dict[str, object]:
    """The result beside what the nameplate alone makes one expect."""
    from zerohertz.commission.plate import guess

    motor = found.motor
    assert motor is not None
    expected = dataclasses.asdict(guess(found.plate))
    rows = [
        {"name": name, "found": value, "guess": expected[name]}
        for name, value in dataclasses.asdict(motor.circuit).items()
    ]
    return {
        "seconds": found.seconds,
        "rows": rows,
        "i_d_A": motor.i_d_A,
        "rotor_flux_Wb": motor.rotor_flux_Wb,
        "lost_V": motor.lost_V,
        "curve": [list(point) for point in motor.curve],
        "mechanics": None if found.mechanics is None else dataclasses.asdict(found.mechanics),
        "folder": str(FOLDER / _NAME),
    }
