"""An estimator from outside the tree, in C and in Python: made, tested, refused, judged."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from zerohertz import build, param_list
from zerohertz.arena import entrant
from zerohertz.errors import UserError
from zerohertz.estimators import bridge, chosen, library, new
from zerohertz.paths import BUILD, ROOT

EXAMPLE = ROOT / "tools" / "zerohertz" / "estimators" / "flux_length.py"
RUN = """
import json, sys
from zerohertz import sim
from zerohertz.estimators import chosen
chosen.use(sys.argv[1])
job = sim.Job(decimate=500, scenario_overrides={"scenario.duration_s": float(sys.argv[2])})
record = sim.run(job)
last = ("speed_rpm", "speed_hat_rpm", "gates_on", "state")
json.dump({"trip": int(record.trip), "fault": record.first_fault, "steps": record.steps,
           "cause": record.cause, "cause_s": record.cause_s,
           **{name: float(record[name][-1]) for name in last}}, sys.stdout)
"""
BAD = """
from zerohertz.estimators.flux_length import FluxLength


class Nan(FluxLength):
    def step(self, x):
        return super().step(x)._replace(omega_e_rad_s=float("nan"))


class Raises(FluxLength):
    def step(self, x):
        raise ValueError("on purpose")


class Diverges(FluxLength):
    def step(self, x):
        self.omega = 1.2 * self.omega + 1.0
        return super().step(x)


class Slow(FluxLength):
    def step(self, x):
        for _ in range(100000):
            pass
        return super().step(x)


class Endless(FluxLength):
    def step(self, x):
        while True:
            pass


class SlowAtOnce(Slow):
    def hold(self, x, omega_e_rad_s):
        for _ in range(100000):
            pass
        return super().hold(x, omega_e_rad_s)


class NoHold:
    init, seed, step = FluxLength.init, FluxLength.seed, FluxLength.step


class OtherStep(FluxLength):
    def step(self, u, i):
        return None
"""


def zh(*words: object, **options) -> subprocess.CompletedProcess[str]:
    command = (sys.executable, "-m", "zerohertz", *map(str, words))
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **options)


def ran(estimator: object, duration_s: float = 6.0) -> dict[str, float]:
    """The end of the smoke run with it, in a process of its own."""
    command = (sys.executable, "-c", RUN, str(estimator), str(duration_s))
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def folder() -> Path:
    """A fresh skeleton in a place that stays the same, so that its build is kept."""
    where = BUILD / "test_plugin"
    shutil.rmtree(where / "my_observer", ignore_errors=True)
    return new.new("my_observer", where)


@pytest.fixture(scope="module")
def bad(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("bad") / "bad.py"
    file.write_text(BAD)
    return file


def test_the_skeleton_is_short_and_passes_its_own_tests(folder):
    lines = (folder / "estimator.c").read_text().splitlines()
    assert len(lines) <= 100
    ((name, passed, said),) = new.run_tests(folder)
    assert (name, passed) == ("test_estimator.c", True), said
    assert "@" not in (folder / "README.md").read_text()


def test_the_example_in_python_is_short():
    assert len(EXAMPLE.read_text().splitlines()) <= 40


def test_a_unit_test_that_fails_is_told(folder, tmp_path):
    broken = Path(shutil.copytree(folder, tmp_path / "my_observer"))
    text = (broken / "estimator.c").read_text()
    (broken / "estimator.c").write_text(
        text.replace("(omega_s_rad_s - slip", "(0.5f * omega_s_rad_s - slip")
    )
    ((_, passed, said),) = new.run_tests(broken)
    assert not passed
    assert "FAIL  the speed of a turning motor" in said


def test_a_read_beyond_an_array_is_found(folder, tmp_path):
    broken = Path(shutil.copytree(folder, tmp_path / "my_observer"))
    test = broken / "test_estimator.c"
    test.write_text("int main(int n, char **v) { (void)v; int a[2] = {0}; return a[n + 1]; }\n")
    ((_, passed, said),) = new.run_tests(broken)
    assert not passed
    assert "index 2 out of bounds" in said or "stack-buffer-overflow" in said


@pytest.mark.parametrize("name", ["My-Observer", "9lives", "a b", ""])
def test_a_name_that_makes_no_sense_is_refused(tmp_path, name):
    with pytest.raises(UserError, match="small letters"):
        new.new(name, tmp_path)


def test_a_name_or_folder_that_is_taken_is_refused(tmp_path):
    with pytest.raises(UserError, match="take another"):
        new.new("hasegawa", tmp_path)
    new.new("mine", tmp_path)
    with pytest.raises(UserError, match="exists; take another name or remove it"):
        new.new("mine", tmp_path)


def test_what_is_no_estimator_is_refused(tmp_path, folder):
    with pytest.raises(UserError, match="no 'no_such'; there are compensated_voltage_model, ekf"):
        chosen.folder_of("no_such")
    incomplete = Path(shutil.copytree(folder, tmp_path / "my_observer"))
    (incomplete / "estimator_signals.def").unlink()
    with pytest.raises(UserError, match=r"has no estimator_signals\.def"):
        chosen.folder_of(str(incomplete))
    with pytest.raises(UserError, match=r"is a class in Python; write its tests"):
        chosen.folder_of(f"{EXAMPLE}:FluxLength")
    with pytest.raises(UserError, match="no such file"):
        chosen.choose(str(tmp_path / "no.py:Such"))


def test_a_class_is_refused_for_an_image_before_anything_is_built():
    began = time.monotonic()
    done = zh("pil", "fig07", "--estimator", f"{EXAMPLE}:FluxLength")
    assert done.returncode == 2
    assert "an image has no Python" in done.stderr
    assert "zh estimator new" in done.stderr
    assert time.monotonic() - began < 20.0


def test_the_drive_runs_with_it_in_c_and_in_python(folder):
    in_c, in_python = ran(folder), ran(f"{EXAMPLE}:FluxLength")
    for end in (in_c, in_python):
        assert (end["trip"], end["fault"]) == (0, 0)
        assert end["speed_rpm"] == pytest.approx(300.0, abs=5.0)
        assert end["speed_hat_rpm"] == pytest.approx(end["speed_rpm"], abs=5.0)
    assert in_python["speed_rpm"] == pytest.approx(in_c["speed_rpm"], abs=1.0)


def test_its_own_parameters_are_the_drives(folder, tmp_path):
    code = (
        "import sys; from zerohertz.estimators import chosen; chosen.use(sys.argv[1])\n"
        "from zerohertz import Drive\n"
        "from zerohertz.paths import ROOT\n"
        "board = ROOT / 'host_sim/boards/paper.toml'\n"
        "own = {'my_observer_filter_s': 0.01}\n"
        "with Drive(ROOT / 'gain_tables/hasegawa2005', board, own) as drive:\n"
        "    drive['my_observer_gain_per_s'] = 30.0\n"
        "    print(drive['my_observer_filter_s'], drive['my_observer_gain_per_s'])\n"
        "    drive['my_observer_gain_per_s'] = 1e6\n"
    )
    done = subprocess.run((sys.executable, "-c", code, folder), capture_output=True, text=True)
    assert done.stdout.split()[1] == "30.0", done.stderr
    assert float(done.stdout.split()[0]) == pytest.approx(0.01)
    assert "my_observer_gain_per_s" in done.stderr.splitlines()[-1]
    # An image has them too, with the values of the configuration.
    config = tmp_path / "mine.toml"
    text = (ROOT / "host_sim/configs/recommended.toml").read_text()
    config.write_text(text + "my_observer_gain_per_s = 25\n")
    made = tmp_path / "image_params.h"
    command = (sys.executable, ROOT / "tools/generate_params.py", "--config", config, "--out", made)
    own = ("--estimator-params", folder / build.OWN_LIST)
    assert subprocess.run(command, capture_output=True).returncode == 2
    assert subprocess.run((*command, *own)).returncode == 0
    assert ".my_observer_gain_per_s = 25.0f" in made.read_text()
    (folder / entrant.OWN_FILE).write_text(
        'title="a"\nreference="b"\nestimator="."\n[parameters]\nmy_observer_filter_s = 0.005\n'
    )
    mine = entrant.of_user(str(folder))
    (folder / entrant.OWN_FILE).unlink()
    assert mine.parameters == {"my_observer_filter_s": 0.005}


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('PARAM_F(OBSERVER, Rs_ohm, "ohm", 0.0f, 1.0f, 0.5f, RUN, "t")', "there is one already"),
        ("PARAM_F(OBSERVER, gain)", ":1: 1 parameters, 0 understood; mend the rest"),
        (
            'PARAM_F(OBSERVER, a, "ohm", 0.0f, 1.0f, 0.5f, RUN, "t")\n'
            'PARAM_F(OBSERVER, b, "ohm", 0.0f, 1.0f, 2.0f, RUN, "t")',
            r":2: b: default 2\.0 is not within 0\.0 to 1\.0",
        ),
        (
            'PARAM_F(OBSERVER, a, "ohm", 0.0f, 1.0f, x, RUN, "t")',
            r":1: a: 0\.0, x, 1\.0: one of them is no number",
        ),
    ],
)
def test_a_bad_list_of_parameters_is_refused(tmp_path, line, said):
    (tmp_path / build.OWN_LIST).write_text(line + "\n")
    with pytest.raises(UserError, match=said):
        param_list.entries(estimator=str(tmp_path))


def test_an_estimator_in_python_has_no_snapshot():
    code = (
        "import sys; from zerohertz.estimators import chosen; chosen.use(sys.argv[1])\n"
        "from zerohertz import Drive\n"
        "from zerohertz.paths import ROOT\n"
        "board = ROOT / 'host_sim/boards/paper.toml'\n"
        "with Drive(ROOT / 'gain_tables/hasegawa2005', board) as drive:\n"
        "    drive.snapshot()\n"
    )
    command = (sys.executable, "-c", code, f"{EXAMPLE}:FluxLength")
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 1
    assert "Drive.snapshot: an estimator in Python has no snapshot" in done.stderr


@pytest.mark.parametrize("name", ["Nan", "Raises"])
def test_what_is_not_finite_ends_in_a_fault(bad, name):
    end = ran(f"{bad}:{name}")
    assert end["fault"] != 0
    assert end["cause"] == "NaN"
    assert 0.0 < end["cause_s"] < 3.0
    assert (end["gates_on"], end["steps"]) == (0.0, 30000)


def test_what_diverges_ends_in_a_fault(bad):
    end = ran(f"{bad}:Diverges")
    assert end["fault"] != 0
    assert end["cause"] in ("OVER_SPEED", "OVER_CURRENT", "SPEED_DEVIATION", "NaN")
    assert end["gates_on"] == 0.0


def test_what_is_too_slow_ends_its_run(bad):
    end = ran(f"{bad}:Slow")
    assert end["trip"] & 16
    assert end["cause"] == "too slow"
    assert end["cause_s"] == pytest.approx(end["steps"] * 200e-6)
    assert end["steps"] < 30000


def test_a_campaign_goes_on_whatever_the_estimator_does(bad):
    done = zh("atlas", "--random", 4, "--estimator", f"{bad}:Nan", "--json", "-j", 2, "--fresh")
    assert done.returncode == 0, done.stderr
    counted = json.loads(done.stdout)["random"]
    assert (counted["points"], counted["held"]) == (4, 0)
    assert counted["causes"]["NaN"]["count"] == 4
    said = zh("atlas", "--random", 4, "--estimator", f"{bad}:Nan", "-j", 2).stdout
    assert "random: points that stopped: NaN 4 (first at " in said
    envelope = ("envelope", "--runs", 2, "--fix", "motor=table1", "--json", "-j", 1, "--fresh")
    # Slow from premagnetisation on: each quick period before would add 250 us to its patience.
    for name, verdict, cause in (("SlowAtOnce", "too_slow", "too slow"), ("Nan", "nan", "NaN")):
        done = zh(*envelope, "--estimator", f"{bad}:{name}")
        assert done.returncode in (0, 1), done.stderr
        found = json.loads(done.stdout)
        assert found["verdicts"] == {verdict: 2}
        assert found["causes"][cause]["count"] == 2


def refused(estimator: object) -> str:
    done = zh("figures", "--estimator", estimator)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    return done.stderr.replace("\n", " ")


def test_a_class_that_does_not_end_is_refused_with_its_line(bad):
    lines = BAD.splitlines()
    loop = lines.index("        while True:") + 1
    said = refused(f"{bad}:Endless")
    assert "too slow" in said
    assert f"{bad}:{loop}: " in said or f"{bad}:{loop + 1}: " in said


@contextmanager
def begun_with(folder: Path, lines: str) -> Iterator[Path]:
    """estimator.c with these lines first in its step; the build is kept."""
    file = folder / "estimator.c"
    text, first = file.read_text(), "const estimator_in_t *in)\n{\n"
    assert first in text
    file.write_text(text.replace(first, first + lines, 1))
    try:
        yield file
    finally:
        file.write_text(text)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("for (volatile int spin = 1; spin == 1;) {}", "too slow at "),
        ("*(volatile int *)(intptr_t)st->estimate.i_residual_A.alpha = 1;", "crashed with SIGSEGV"),
    ],
)
def test_what_ends_the_first_periods_is_refused_with_its_line(folder, line, said):
    with begun_with(folder, f"    {line}\n") as file:
        told = refused(folder)
        assert said in told
        assert f"/{file.name}:{file.read_text().splitlines().index('    ' + line) + 1}" in told


def test_what_crashes_later_takes_its_worker_and_not_the_command(folder):
    late = (
        "    static int32_t left = 50000; /* 10 s: after the start, in the first run */\n"
        "    if (--left < 0) {\n"
        "        *(volatile int *)(intptr_t)left = 1;\n"
        "    }\n"
    )
    with begun_with(folder, late):
        done = zh("atlas", "--random", 1, "-j", 1, "--fresh", "--estimator", folder)
    assert done.returncode == 2
    assert "a worker died" in done.stderr


def test_a_class_with_another_signature_is_refused(bad):
    for name, said in (
        ("NoHold", "has no hold; expected: def hold(self, x: 'Sample', omega_e_rad_s: 'float')"),
        ("OtherStep", "step(self, u, i); expected: def step(self, x: 'Sample')"),
        ("NoSuch", "has no class 'NoSuch'"),
    ):
        with pytest.raises(UserError) as refused:
            bridge._loaded(f"{bad}:{name}")
        assert said in str(refused.value)


def test_a_wrong_signature_is_refused_with_the_expected_one(folder):
    other = folder.parent / "other_observer"
    shutil.rmtree(other, ignore_errors=True)
    new.new("other_observer", folder.parent)
    text = (other / "estimator.c").read_text()
    wrong = text.replace(
        "float omega_e_rad_s)\n{\n    const motor", "int omega)\n{\n    const motor"
    )
    assert wrong != text
    (other / "estimator.c").write_text(wrong)
    done = zh("figures", "--estimator", other)
    assert done.returncode == 2
    said = " ".join(done.stderr.split())
    assert "estimator_hold is not what the drive calls; expected: void estimator_hold(const" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("a.c:(.text+0x1): undefined reference to `estimator_seed'", "estimator_seed is missing"),
        ("drive.c:9: error: implicit declaration of function ‘estimator_sum’", "is missing; expe"),
        ("a.h:9:3: error: unknown type name 'estimator_state_t'", "define it in estimator_types"),
        ("a.c:9:3: error: expected ‘;’ before ‘}’ token", "does not compile: a.c:9:3: error: exp"),
        ("CMake Error at a:1 (b):\n\n  no file\n  c.c\n\n", "no file c.c"),
        ("CMake Error at a:1 (b):\n  a/b makes no\n  c;\nCall Stack", "a/b makes no c;"),
        (
            "a.c:61:6: error: no previous prototype for ‘estimator_hodl’ [-Werror=missing-proto",
            "the drive calls no estimator_hodl; expected: void estimator_hold(const",
        ),
        (
            "a.c:6:6: error: no previous prototype for function 'estimator_seek' [-Werror",
            "calls no estimator_seek; expected: void estimator_seed(",
        ),
        (
            "d.c:9:3: error: ‘estimator_state_t’ has no member named ‘estimate’",
            "has no estimate; ex",
        ),
    ],
)
def test_the_compilers_words_become_one_line(said, told):
    assert told in library.refusal(said)


def test_every_function_has_a_prototype_in_the_contract():
    for verb in (*library.VERBS, "sum"):
        assert f"estimator_{verb}(" in library.prototype(f"estimator_{verb}")


def test_the_choice_reaches_workers(folder, monkeypatch):
    for name in (chosen.ESTIMATOR, chosen.PYTHON):
        monkeypatch.setenv(name, "")  # so that it is restored
        monkeypatch.delenv(name)
    chosen.choose(str(folder))
    assert os.environ[chosen.ESTIMATOR] == str(folder)
    assert chosen.chosen_name() == "my_observer"
    chosen.choose(f"{EXAMPLE}:FluxLength")
    assert chosen.chosen_name() == "flux_length.py:FluxLength"
    assert chosen.python_digest() != b""
    chosen.choose("hasegawa")
    assert chosen.chosen_name() == ""
