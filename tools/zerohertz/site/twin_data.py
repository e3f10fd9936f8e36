"""What the twin's page knows beside firmware and plant: experiments, the atlas, faults, hashes.

Every run is written down as the job that the native library would get, word for word, so that the
page and `zh figures` ask the same of the same firmware.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from zerohertz import param_list, sim
from zerohertz.atlas import bench_run, special, zero_hertz
from zerohertz.atlas.points import Point, standard_map
from zerohertz.atlas.simulate import Bench, job_of, judge_record, make_bench
from zerohertz.drive import override_lines
from zerohertz.image import fault_page
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.scenario import evaluate
from zerohertz.scenario.figures import PAPER
from zerohertz.scenario.setup import figure_scenario, load_setup, scenario_file

CONFIGS = {"paper": "the paper's tuning", "recommended": "recommended", "no_gain": "L = 0"}
SETTINGS = ("observer_gain_enable", "eps1_mode", "eps1")  # which the page has controls for
SEED = 1
BATCH = 64
_GUARD_RECORDED = 8
DWELL_RPM = (15.0, 30.0)
DWELL_S = 130.0

SITUATION_TEXT = {
    "no_load": "No load, step to standstill",
    "load_50": "Half the rated load, step to standstill",
    "load_50_rs_1.5": "Half the rated load, the observer's Rs a third too small",
    "regen_ramp": "The load drives the motor at 60 min⁻¹",
}


class Files:
    """Texts of rigs, boards and motors, each once."""

    def __init__(self) -> None:
        self.rigs: dict[str, str] = {}
        self.boards: dict[str, str] = {}
        self.motors: dict[str, dict[str, str]] = {}

    def job(self, job: sim.Job) -> dict[str, Any]:
        """A job as the page passes it on; gain tables only by motor folder."""
        motor = Path(job.motor_dir)
        if motor.name not in self.motors:
            names = ("motor.toml", "l_gain.json")
            self.motors[motor.name] = {n: (motor / n).read_text(encoding="utf-8") for n in names}
        scenario = job.scenario
        if isinstance(scenario, Path):
            scenario = scenario.read_text(encoding="utf-8")
        found: dict[str, Any] = {
            "scenario": scenario,
            "rig": _kept(self.rigs, Path(job.rig)),
            "board": _kept(self.boards, Path(job.board)),
            "motor": motor.name,
            "seed": job.seed or 0,
            "flags": _GUARD_RECORDED if job.guard_recorded else 0,
        }
        for name in ("scenario_overrides", "rig_overrides", "board_overrides"):
            found[name] = override_lines(getattr(job, name)).decode()
        found["config"] = override_lines(job.firmware_config).decode()
        found["firmware"] = override_lines(job.firmware).decode()
        return found


def figure_job(figure: int, config: str = "paper") -> sim.Job:
    """As `zh golden` runs it."""
    return evaluate.job(evaluate.Run(load_setup(config), figure, SEED))


def figure_hashes() -> dict[str, sim.Hashes]:
    """Of every traced signal of every figure, computed by the native library."""
    found = {}
    for figure in PAPER:
        with sim.signal_hashes() as hashes:
            sim.run(figure_job(figure))
        found[figure_scenario(figure)] = hashes[0]
    return found


def content(hashes: bool = True, atlas: bool = True) -> dict[str, Any]:
    """All of it, ready for JSON."""
    files = Files()
    found: dict[str, Any] = {
        "figures": [_figure(files, figure) for figure in PAPER],
        "situations": [_situation(files, *item) for item in evaluate.SITUATIONS.items()],
        "special": list(_special(files)),
        "dwell": [_dwell(files, speed_rpm) for speed_rpm in DWELL_RPM],
        "live": _live(files),
        "faults": faults(),
        "configs": CONFIGS,
        "tunings": {config: _tuning(config) for config in CONFIGS},
        "defaults": {name: param_list.defaults()[name] for name in SETTINGS},
        "atlas": {config: _atlas(files, config) for config in CONFIGS} if atlas else {},
    }
    if hashes:
        found["signals"] = list(sim.signal_names())
        found["hashes"] = {
            name: [f"{value:016x}" for value in each.values()]
            for name, each in figure_hashes().items()
        }
    return found | {"rigs": files.rigs, "boards": files.boards, "motors": files.motors}


def studio_content() -> dict[str, Any]:
    """For the studio on a drive in the page: the recommended tuning on the bench of the atlas."""
    files = Files()
    job = _live_job("recommended")
    period_s = tomllib.loads(Path(job.board).read_text(encoding="utf-8"))["control"]["period_s"]
    found = {"job": files.job(job), "period_s": period_s}
    data = {"rigs": files.rigs, "boards": files.boards, "motors": files.motors}
    return found | {"data": data}


def faults() -> list[dict[str, Any]]:
    """Of fault_list.def: bit, name, text, cause, remedy."""
    keys = ("bit", "name", "reaction", "text", "cause", "remedy")
    return [{key: getattr(entry, key) for key in keys} for entry in fault_page.entries()]


def _kept(texts: dict[str, str], path: Path) -> str:
    texts.setdefault(path.stem, path.read_text(encoding="utf-8"))
    return path.stem


def _figure(files: Files, figure: int) -> dict[str, Any]:
    head = tomllib.loads(scenario_file(figure_scenario(figure)).read_text())
    what, shown = PAPER[figure]
    job = files.job(figure_job(figure))
    return {
        "id": figure_scenario(figure),
        "title": f"Fig. {figure}",
        "text": what,
        "paper": shown,
        "firmware": head["firmware"],
        "job": job,
    }


def _situation(files: Files, name: str, figure: int) -> dict[str, Any]:
    return {
        "id": name,
        "title": SITUATION_TEXT[name],
        "text": f"scenario {figure_scenario(figure)}, recommended tuning",
        "job": files.job(figure_job(figure, "recommended")),
    }


def _special(files: Files) -> Iterable[dict[str, Any]]:
    """Passages through zero frequency from `zh special`, at the nominal resistance."""
    setup = load_setup("recommended")
    for load_pu, what in ((-1.0, "driven"), (1.0, "braked")):
        job, _ = bench_run.job(setup, special.crossing(load_pu))
        yield {
            "id": f"crossing_{what}",
            "title": f"Slow passage through zero frequency, {what}",
            "text": f"150 to -150 min⁻¹ at 5 min⁻¹/s, rated load {load_pu:+.0f}",
            "job": files.job(job),
        }


def dwell_job(speed_rpm: float) -> sim.Job:
    """Zero stator frequency, kept by the load, while Rs drifts; flux steering avoids it and is off.

    Without modulation the drive gets lost, and the load pulls the shaft away.
    """
    flux_Wb = load_motor(ROOT / "gain_tables" / "hasegawa2005").circuit.M_H * bench_run.I_D_A
    load_Nm = special.dwell_load_Nm(flux_Wb, speed_rpm)
    what = bench_run.Experiment(
        duration_s=DWELL_S,
        speed_rpm=[(0.0, speed_rpm)],
        load_Nm=[(0.0, 0.0), (5.0, 0.0), (10.0, load_Nm)],
        servo_Nm_per_turn=zero_hertz.SERVO_NM_PER_TURN,
        servo_from_s=10.0,
        rs_drift=[(0.0, 1.0), (20.0, 1.0), (100.0, 1.2)],
        firmware={"steer_min_Hz": 0.0, "overload_motor_A": 0.0},
    )
    return bench_run.job(load_setup("recommended"), what)[0]


def _dwell(files: Files, speed_rpm: float) -> dict[str, Any]:
    return {
        "id": f"dwell_{speed_rpm:.0f}",
        "title": f"Dwell at {speed_rpm:.0f} min⁻¹",
        "job": files.job(dwell_job(speed_rpm)),
    }


def _tuning(config: str) -> dict[str, str]:
    setup = load_setup(config)
    return {"config": override_lines(setup.params).decode(), "motor": setup.motor_dir.name}


def _live(files: Files) -> dict[str, Any]:
    """Operated by hand: the bench of the atlas with the nominal motor."""
    return {config: files.job(_live_job(config)) for config in CONFIGS}


def _live_job(config: str) -> sim.Job:
    bench = make_bench(load_setup(config))
    job = job_of(bench, Point("live", 0, SEED, 0.0, 0.0, 1.0))
    # A fault may leave the motor turning; the next start catches it.
    firmware = dict(job.firmware) | {"flying_start": 1.0}
    return dataclasses.replace(job, scenario="\n", firmware=firmware)


def _atlas(files: Files, config: str) -> list[dict[str, Any]]:
    bench = make_bench(load_setup(config))
    points = standard_map("map_i")
    found = []
    for first in range(0, len(points), BATCH):
        group = points[first : first + BATCH]
        records = sim.run_batch([job_of(bench, point) for point in group])
        found += [_cell(files, bench, *pair) for pair in zip(group, records, strict=True)]
    return found


def _cell(files: Files, bench: Bench, point: Point, record: sim.Record) -> dict[str, Any]:
    judged = judge_record(bench, point, record)
    return {
        "speed_rpm": point.speed_rpm,
        "load_pu": point.load_pu,
        "rs_ratio": point.rs_ratio,
        "outcome": str(judged.outcome),
        "job": files.job(job_of(bench, point)),
    }
