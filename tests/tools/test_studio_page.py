"""What the page of the studio is made of: the firmware's own texts, a bundle without a network."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from zerohertz import param_list
from zerohertz.drive import Fault, State
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.studio import bundle, catalog
from zerohertz.studio.pages import local_hosts
from zerohertz.studio.tools import Tools


def test_every_parameter_fault_state_signal_and_reason_has_its_text() -> None:
    told = catalog.catalogue()
    assert list(told["parameters"]) == list(param_list.entries())
    assert all(told["parameters"].values())
    assert {fault["name"] for fault in told["faults"].values()} == {fault.name for fault in Fault}
    assert all(fault["remedy"] and fault["cause"] for fault in told["faults"].values())
    assert set(told["states"]) == {int(state) for state in State}
    source = (ROOT / "firmware" / "unit" / "signal_list.def").read_text()
    assert len(told["signals"]) == len(re.findall(r"^SIGNAL_[FUOX]+\(", source, re.MULTILINE))
    header = (ROOT / "firmware" / "law" / "confidence" / "supervisor.h").read_text()
    assert len(told["reasons"]) == len(re.findall(r"define SUPERVISOR_\w+\s+\(1u <<", header))


def test_the_catalogue_is_a_script_of_one_object() -> None:
    name, content = catalog.script().split(" = ", 1)
    assert name == "window.zhCatalog"
    assert "faults" in json.loads(content.rstrip(";\n"))


@pytest.mark.skipif(shutil.which("npm") is None, reason="needs npm")
def test_the_page_loads_nothing_from_elsewhere() -> None:
    folder = bundle.ensure_bundle()
    page = (folder / "index.html").read_text()
    for reference in re.findall(r'(?:src|href)="([^"]+)"', page):
        assert (folder / reference).is_file()
    style = (folder / "studio.css").read_text()
    assert "@import" not in style
    assert "url(" not in style
    script = (folder / "studio.js").read_text()
    for name in ("fetch(", "XMLHttpRequest", "importScripts", "eval("):
        assert name not in script
    size = sum(path.stat().st_size for path in folder.iterdir())
    assert size < 200_000


def test_the_packages_are_pinned_and_name_no_registry() -> None:
    versions = json.loads((bundle.WEB / "package.json").read_text())
    for version in (versions["dependencies"] | versions["devDependencies"]).values():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version)
    lock = (bundle.WEB / "package-lock.json").read_text()
    assert "resolved" not in lock
    assert '"integrity"' in lock


def test_without_npm_it_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr(bundle, "FOLDER", tmp_path)
    with pytest.raises(UserError, match="needs npm"):
        bundle.install(tmp_path)


def test_only_this_machine_is_served() -> None:
    assert local_hosts(8405) == {"127.0.0.1:8405", "localhost:8405"}


def test_the_tools_want_a_motor_first_and_one_job_at_a_time() -> None:
    events: list[dict[str, object]] = []
    tools = Tools(lambda: None, bytes(16))  # type: ignore[arg-type, return-value]
    for job in ("design", "keep", "trial"):
        tools._run(job, tools._jobs[job], {}, events.append)
    assert all("no motor has been found yet" in str(event["error"]) for event in events)
    with tools._busy:
        tools._run("design", tools._jobs["design"], {}, events.append)
    assert "something else is going on" in str(events[-1]["error"])
    tools._run("commission", tools._jobs["commission"], {"plate": {"power_kW": -1}}, events.append)
    assert "the nameplate" in str(events[-1]["error"])
    with pytest.raises(KeyError):
        tools.begin({"do": "no such job"}, events.append)
