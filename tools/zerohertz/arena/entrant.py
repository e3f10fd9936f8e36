"""Who takes part: an estimator, the configuration around it, and what its own rules set.

title = "Schauder's MRAS (1992)"
reference = "C. Schauder, ..., IEEE Trans. Ind. Appl. 28(5), 1992"
checked = "..."               # optional: what shows that it is not detuned, with the test
estimator = "schauder_mras"   # firmware/law/estimator, a folder or FILE.py:CLASS, from here
base = "recommended"          # host_sim/configs: loops, start-up, inverter identification
table = "..."                 # optional: folder with another gain table
[parameters]                  # optional: overrides
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz import param_list
from zerohertz.build import IN_TREE
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import folder_of
from zerohertz.param_list import Value
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup, load_setup, parameters_of

ENTRANTS = Path(__file__).parent / "entrants"
OWN_FILE = "arena.toml"  # in a folder given by --estimator; without it: the recommended drive
OURS = "ours"
# Without what the drive finds out: Rs of the nameplate, the inverter of the data sheet. And without
# the check of the voltage, which needs the inverter's true loss.
BARE: Mapping[str, Value] = {
    "rs_measure": 0,
    "dead_time_identify": 0,
    "rs_track_gain": 0.0,
    "m_track": 0,
    "offset_track": 0,
    "heat_rise": 0.0,
    "sup_Rs_uncertainty": 0.3,
    "voltage_check_V": 0.0,
}
_TEXTS = ("title", "reference", "estimator")
_KEYS = (*_TEXTS, "checked", "base", "table", "parameters")


@dataclasses.dataclass(frozen=True)
class Entrant:
    """One line of the ranking."""

    name: str
    title: str
    reference: str
    estimator: str  # as chosen.choose takes it
    base: str
    table: str = ""  # folder; empty: the base's
    parameters: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    checked: str = ""

    def setup(self, bare: bool = False) -> Setup:
        """The drive around it."""
        base = load_setup(self.base)
        params = {**base.params, **self.parameters}
        if bare:
            known = param_list.defaults() | params
            data_sheet = 1.0 if known["dead_time_identify"] else known["dead_time_fraction"]
            params = {**params, **BARE, "dead_time_fraction": data_sheet}
        motor_dir = Path(self.table) if self.table else base.motor_dir
        return dataclasses.replace(base, name=self.name, motor_dir=motor_dir, params=params)

    def as_json(self) -> dict[str, Any]:
        return dataclasses.asdict(self) | {"parameters": dict(self.parameters)}


def known() -> dict[str, Entrant]:
    """Those of the checkout, ours first."""
    files = sorted(ENTRANTS.glob("*.toml"), key=lambda path: (path.stem != OURS, path.stem))
    return {path.stem: read(path) for path in files}


def read(path: Path) -> Entrant:
    """UserError names file and key."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{path}: not valid TOML: {error}; correct the syntax") from None
    for key in content:
        if key not in _KEYS:
            raise UserError(f"{path}: {key}: unknown key; known are {', '.join(_KEYS)}")
    for key in _TEXTS:
        if not isinstance(content.get(key), str):
            raise UserError(f"{path}: {key}: a text is needed; add it")
    name = path.stem if path.name != OWN_FILE else path.parent.name
    estimator = _placed(content["estimator"], path)
    return Entrant(
        name=name,
        title=content["title"],
        reference=content["reference"],
        estimator=estimator,
        base=content.get("base", "recommended"),
        table=_table(content.get("table", ""), path),
        parameters=parameters_of(content.get("parameters", {}), path, _folder(estimator)),
        checked=str(content.get("checked", "")),
    )


def of_user(estimator: str) -> Entrant:
    """From --estimator; with an arena.toml in its folder as that says."""
    if ".py:" in estimator:
        absolute = _absolute(estimator)
        name = Path(absolute).name  # file.py:Class, as it was written
        return Entrant(name, name, "", absolute, "recommended")
    folder = folder_of(estimator)
    if (folder / OWN_FILE).is_file():
        return read(folder / OWN_FILE)
    return Entrant(folder.name, folder.name, "", str(folder), "recommended")


def _placed(estimator: str, file: Path) -> str:
    """A name of the tree as it is, a path as seen from the file."""
    if (IN_TREE / estimator).is_dir() and "/" not in estimator and estimator != ".":
        return estimator
    return str((file.parent / estimator).resolve())


def _folder(estimator: str) -> str:
    """Where its own parameters would be."""
    return str(IN_TREE / estimator) if "/" not in estimator else estimator


def _absolute(python: str) -> str:
    file, _, name = python.rpartition(":")
    return f"{Path(file).resolve()}:{name}"


def _table(table: str, file: Path) -> str:
    if not table:
        return ""
    for folder in (ROOT / "gain_tables" / table, file.parent / table):
        if (folder / "motor.toml").is_file():
            return str(folder.resolve())
    raise UserError(f"{file}: table: no motor folder '{table}'; correct the name")
