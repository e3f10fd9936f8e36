"""Processor in the loop: the flash image on the emulated core against the SIL firmware.

`tools/zh pil all` runs every figure; here a share of them, of more than a million control periods:
stable, lost, tripping, with and without L, eps1 and a wrong Rs.
"""

from __future__ import annotations

import dataclasses
import json

import pytest

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.errors import UserError
from zerohertz.image import budget, command, loop, sizes
from zerohertz.image.command import Experiment, measure, summary
from zerohertz.image.emulator import EXIT_DONE
from zerohertz.image.loop import End
from zerohertz.scenario.setup import load_setup

Runs = dict[Experiment, loop.PilRun]

EXPERIMENTS = (
    Experiment("fig07", "paper"),
    Experiment("fig11", "paper"),
    Experiment("fig14", "paper"),
    Experiment("fig17", "paper"),
    Experiment("fig17", "recommended"),
)
PERIODS_MIN = 1_000_000


@pytest.fixture(scope="module")
def runs() -> Runs:
    return {experiment: measure(experiment, "mps2-an386", None) for experiment in EXPERIMENTS}


def recommended_job(**changes: object) -> sim.Job:
    setup = load_setup("recommended")
    return sim.Job(
        motor_dir=setup.motor_dir,
        board=setup.board,
        rig=setup.rig,
        firmware_config=setup.params,
        decimate=1_000_000,
        max_steps=12_000,
        **changes,
    )


def test_the_image_and_the_sil_agree_in_every_bit_of_a_million_periods(runs: Runs) -> None:
    result = summary(list(runs.items()))
    print(json.dumps({k: v for k, v in result.items() if k != "runs"}))
    assert [run["difference"] for run in result["runs"]] == [""] * len(EXPERIMENTS)
    assert (result["differing_runs"], result["differing_bits"]) == (0, 0)
    assert result["periods"] >= PERIODS_MIN
    assert result["late_periods"] == 0


def test_no_control_period_needs_more_instructions_than_committed(runs: Runs) -> None:
    """Where it does, `zh bench --write` and a commit that says why."""
    known = budget.committed()
    short = budget.ALL_OPTIONS[0]
    every_option = measure(short, "mps2-an386", None)
    measured = {e.name: budget.period_figures(run) for e, run in runs.items()}
    measured[short.name] = budget.period_figures(every_option)
    assert budget.grown(measured, known["periods"]) == []


def test_the_stack_never_went_below_its_bound(runs: Runs) -> None:
    bound = sizes.stack_bound(build_image("qemu_mps2"), "qemu_mps2")
    used = max(run.stack_used_bytes for run in runs.values())
    assert 0 < used <= bound <= min(run.stack_bytes for run in runs.values())


def test_the_same_image_runs_on_a_cortex_m7() -> None:
    run = measure(Experiment("fig07", "recommended"), "mps2-an500", 30_000)
    assert (run.end, run.periods, run.differing_bits) == (End.EQUAL, 30_000, 0)


def test_an_image_of_its_own_parameters_is_the_simulated_configuration() -> None:
    """What lies in flash (zh params) is what the SIL was given: nothing is sent to the image."""
    run = loop.run(recommended_job(), build_image("qemu_mps2"), own_params=True)
    assert (run.end, run.exit_code, run.gates_on) == (End.EQUAL, EXIT_DONE, True)


def test_a_difference_of_one_parameter_is_found_and_named() -> None:
    """Negative control: the image keeps its parameters, the SIL gets one an ulp away. Rs is
    measured first: adapt_ki acts from period 20 000 on, after the end of the smoke run."""
    other = dataclasses.replace(
        recommended_job(firmware={"adapt_ki": 2000.0001}),
        max_steps=26_000,
        scenario_overrides={"scenario.duration_s": 5.2},
    )
    run = loop.run(other, build_image("qemu_mps2"), own_params=True)
    assert run.end == End.DIFFERS
    assert 0 < run.differing_bits < 64
    assert "period" in run.difference
    assert "x_rad_s: image" in run.difference


def test_the_wrong_gain_table_is_refused() -> None:
    with pytest.raises(UserError, match="carries another gain table"):
        loop.run(recommended_job(), build_image("qemu_mps2_paper"))


def test_the_banner_names_what_the_image_is(capfd: pytest.CaptureFixture[str]) -> None:
    elf = build_image("qemu_mps2")
    text = loop.run(recommended_job(), elf).text
    words = dict(word.split("=") for word in text.split() if "=" in word)
    assert words["port"] == "qemu_mps2"
    assert words["config"] == "recommended"
    table = json.loads((load_setup("recommended").motor_dir / "l_gain.json").read_text())
    assert words["table"] == table["crc32c"]
    image = elf.with_suffix(".bin").read_bytes()
    assert int(words["image"], 16) == int.from_bytes(image[-4:], "little")


def test_a_run_that_compares_only_the_start_says_so() -> None:
    start = command.Experiment("smoke", "recommended")
    said = command.never_ran(start, command.measure(start, "mps2-an386", None))
    assert said.startswith("smoke recommended: the drive did not reach RUN in 15000 periods;")
    scenario, _, periods = command.LONG_ENOUGH.split()
    whole = command.Experiment(scenario, "recommended")
    assert command.never_ran(whole, command.measure(whole, "mps2-an386", int(periods))) == ""


def test_unknown_names_are_refused_with_the_choices() -> None:
    with pytest.raises(UserError, match="no 'fig99'; there are all, fig06"):
        command.experiments("fig99", None)
    with pytest.raises(UserError, match="there are paper, recommended"):
        command.experiments("all", "best")
