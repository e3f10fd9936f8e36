"""`zh golden`: one bit is found, however many signals and runs; wrong input is refused."""

from __future__ import annotations

import dataclasses
import json

import pytest
from typer.testing import CliRunner

from zerohertz import sim
from zerohertz.cli import make_app
from zerohertz.errors import UserError
from zerohertz.golden import runs, store
from zerohertz.golden.command import text

SHORT = sim.Job(max_steps=2000)
HASHES = {
    "fig07": {"duty_u": 0x0123456789ABCDEF, "state": 7},
    "fig16": {"duty_u": 0xFEDCBA9876543210, "state": 8},
}


def hashes(job: sim.Job = SHORT) -> sim.Hashes:
    with sim.signal_hashes() as found:
        sim.run(job)
    assert len(found) == 1
    return found[0]


def golden(tmp_path, found) -> store.Golden:
    """As it comes back from its file."""
    store.write(store.golden_of(found), tmp_path / "golden.json")
    return store.read(tmp_path / "golden.json")


def test_every_traced_signal_is_hashed_and_a_run_repeats():
    first = hashes()
    assert tuple(first) == sim.signal_names()
    assert {"duty_u", "lambda_r_hat_beta_Wb", "restarts_used"} <= set(first)
    assert first == hashes()
    assert first == hashes(dataclasses.replace(SHORT, decimate=50))  # whatever is recorded


def test_one_period_more_changes_every_hash():
    longer = hashes(dataclasses.replace(SHORT, max_steps=2001))
    assert all(longer[name] != value for name, value in hashes().items())


def test_the_last_bit_of_a_parameter_is_found_where_it_matters():
    exact, changed = 0.015, 0.015 * (1.0 + 2.0**-23)
    one, other = (
        hashes(dataclasses.replace(SHORT, max_steps=10000, firmware={"speed_J_kg_m2": J}))
        for J in (exact, changed)
    )
    differing = {name for name in one if one[name] != other[name]}
    assert "duty_u" in differing
    assert "rs_periods" not in differing


def test_outside_nothing_is_hashed():
    with sim.signal_hashes() as found:
        pass
    sim.run(SHORT)
    assert found == []


def test_the_same_hashes_do_not_differ(tmp_path):
    now = store.golden_of(HASHES)
    committed = golden(tmp_path, HASHES)
    assert committed == now
    assert store.difference(committed, now, whole=True).none
    assert f"no bit differs; hash {now.over_all}" in text(now, store.Difference({}, [], [], [], []))


@pytest.mark.parametrize("bit", [0, 31, 63])
def test_one_bit_is_found_with_its_signal_and_run(tmp_path, bit):
    committed = golden(tmp_path, HASHES)
    flipped = {**HASHES, "fig16": {**HASHES["fig16"], "state": 8 ^ 1 << bit}}
    found = store.difference(committed, store.golden_of(flipped), whole=True)
    assert set(found.signals) == {"state"}
    # The 24 bits that are kept of each run only tell where; the hash over all runs decides.
    assert found.signals["state"] == (["fig16"] if bit >= 40 else [])
    said = text(store.golden_of(flipped), found)
    assert "state" in said
    assert "duty_u" not in said


def test_signals_that_come_and_go_leave_the_others_alone(tmp_path):
    committed = golden(tmp_path, HASHES)
    changed = {run: {"new": 1, "duty_u": found["duty_u"]} for run, found in HASHES.items()}
    found = store.difference(committed, store.golden_of(changed), whole=True)
    assert found == store.Difference({}, ["new"], ["state"], [], [])
    assert not found.none


def test_a_part_of_the_runs_is_compared_alone(tmp_path):
    committed = golden(tmp_path, HASHES)
    now = store.golden_of({"fig16": {**HASHES["fig16"], "duty_u": 1}})
    found = store.difference(committed, now, whole=False)
    assert found == store.Difference({"duty_u": ["fig16"]}, [], [], [], [])
    assert store.difference(committed, now, whole=True).runs_gone == ["fig07"]
    more = store.golden_of({**HASHES, "fig18": HASHES["fig16"]})
    assert store.difference(committed, more, whole=True).runs_added == ["fig18"]
    assert "runs not in the file: fig18" in text(more, store.difference(committed, more, True))


def test_every_mode_figure_and_group_of_faults_has_its_runs():
    names = runs.select("", False)
    assert len(names) > 100
    assert set(runs.select("fig16", False)) == {f"figures.fig16.{c}" for c in runs.CONFIGS}
    assert runs.select("restart,fig07.paper", False) == ["figures.fig07.paper", "modes.restart.1"]
    assert 0 < len(runs.select("", True)) < len(names) / 4


def test_an_unknown_run_is_refused_with_the_list():
    with pytest.raises(UserError, match=r"fig99: no such run; known are .*fig06.*weakening"):
        runs.select("fig07,fig99", False)


def test_a_missing_file_says_what_to_run(tmp_path):
    with pytest.raises(UserError, match="no such file; write it with `zh golden --write`"):
        store.read(tmp_path / "none.json")


@pytest.mark.parametrize("damage", ["", "{}", '{"signals": {"a": "0"}, "runs": {"b": "AAA"}}'])
def test_a_damaged_file_is_refused(tmp_path, damage):
    file = tmp_path / "golden.json"
    file.write_text(damage)
    with pytest.raises(UserError, match="damaged"):
        store.read(file)


def command(*words: str):
    return CliRunner().invoke(make_app(), ["golden", *words])


def test_the_command_passes_and_finds_a_flipped_bit(tmp_path, monkeypatch):
    done = command("--only", "fig07.paper", "-j", "1")
    assert done.exit_code == 0, done.output
    content = json.loads(store.FILE.read_text())
    line = content["runs"]["figures.fig07.paper"]
    content["runs"]["figures.fig07.paper"] = ("B" if line[0] == "A" else "A") + line[1:]
    file = tmp_path / "golden.json"
    file.write_text(json.dumps(content))
    monkeypatch.setattr(store, "FILE", file)
    done = command("--only", "fig07.paper", "-j", "1", "--json")
    assert done.exit_code == 1
    said = json.loads(done.stdout)
    assert said["difference"]["signals"] == {"duty_u": ["figures.fig07.paper"]}
    assert not said["equal"]


def test_only_all_runs_are_written():
    done = command("--write", "--quick")
    assert isinstance(done.exception, UserError)
