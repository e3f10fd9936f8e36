"""A configuration: which rig, board and gain table, and the firmware's tuning.

host_sim/configs/<name>.toml:  [config] name motor board rig  [params] <firmware parameter> = value
`motor` is a folder of gain_tables or an absolute path, `board` and `rig` are files of host_sim.
[params] are parameters of firmware/parameters/param_list.def, choices by name or number; what a
figure itself prescribes (L, eps1 mode, observer Rs) is in its scenario and wins. Python's standard
library alone: the build reads them too.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from zerohertz import param_list
from zerohertz.errors import UserError
from zerohertz.param_list import Value
from zerohertz.paths import ROOT

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

CONFIGS = ROOT / "host_sim" / "configs"
SCENARIOS = ROOT / "host_sim" / "scenarios"


@dataclasses.dataclass(frozen=True)
class Setup:
    """Everything of a run but the experiment and the seed."""

    name: str
    motor_dir: Path
    board: Path
    rig: Path
    params: Mapping[str, Value]
    # For searches and sensitivities: section.key -> value, and a table instead of the motor's.
    rig_overrides: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    gain: npt.NDArray[np.float32] | None = None

    @property
    def rig_name(self) -> str:
        """As tables and pictures name it."""
        return f"rig {self.rig.stem}" + (" changed" if self.rig_overrides else "")

    def parameters(self) -> dict[str, Value]:
        """Every firmware parameter but those that a figure prescribes."""
        return param_list.defaults() | dict(self.params)

    def i_q_limit_A(self) -> float:
        """The limit of i_q* in force, i_d having priority: eq. of speed_control.h."""
        known = self.parameters()
        room_A = math.sqrt(max(known["i_max_A"] ** 2 - known["i_d_A"] ** 2, 0.0))
        return min(known["i_q_max_A"], room_A)

    def speed_hat_max_rpm(self) -> float:
        """The firmware's bound of w_hat as mechanical speed."""
        known = self.parameters()
        return known["omega_max_rad_s"] / known["pole_pairs"] * 30.0 / math.pi


def config_file(name: str | Path) -> Path:
    """A configuration by name, a TOML file, or a folder made by `zh new`: derived when needed."""
    path = Path(name)
    if path.suffix == ".toml":
        return path
    if (path / "application.toml").is_file():
        # Here and not above: the build has the standard library alone, and names a file.
        from zerohertz.configuration.derive import derive, firmware_file

        return firmware_file(derive(path, guessed=True))
    if "/" in str(name) and not path.is_dir():
        raise UserError(f"{name}: no such folder; make it with tools/zh new {name}")
    path = CONFIGS / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in CONFIGS.glob("*.toml")))
        raise UserError(
            f"--config: no '{name}'; there are {known}, or name a TOML file or a folder"
        )
    return path


def load_setup(name: str | Path) -> Setup:
    """A configuration by name, or of a TOML file."""
    path = config_file(name)
    data = _read_toml(path)
    for section in data:
        if section not in ("config", "params"):
            raise UserError(f"{path}: [{section}]: unknown section; known are config, params")
    head = data.get("config", {})
    for key in head:
        if key not in ("name", "motor", "board", "rig"):
            raise UserError(f"{path}: config.{key}: unknown key; known are name, motor, board, rig")
    for key in ("name", "motor", "board", "rig"):
        if not isinstance(head.get(key), str):
            raise UserError(f"{path}: config.{key}: a text is needed; add it")
    setup = Setup(
        name=head["name"],
        motor_dir=ROOT / "gain_tables" / head["motor"],
        board=ROOT / "host_sim" / "boards" / f"{head['board']}.toml",
        rig=ROOT / "host_sim" / "rigs" / f"{head['rig']}.toml",
        params=parameters_of(data.get("params", {}), path),
    )
    for key, needed in (("motor", setup.motor_dir), ("board", setup.board), ("rig", setup.rig)):
        if not needed.exists():
            raise UserError(f"{path}: config.{key}: there is no {needed}; correct the name")
    return setup


def scenario_file(name: str) -> Path:
    return SCENARIOS / f"{name}.toml"


def figure_scenario(figure: int) -> str:
    return f"fig{figure:02d}"


def event_s(scenario: Path) -> float:
    """t0 of protocol S, the start of the ramp of protocol R."""
    head = _read_toml(scenario).get("scenario", {})
    key = {"S": "step_time_s", "R": "ramp_start_s"}.get(head.get("protocol", ""))
    if key is None or key not in head:
        raise UserError(f"{scenario}: scenario.protocol: no predicate applies; give S or R")
    return float(head[key])


def parameters_of(content: Any, path: Path, estimator: str | None = None) -> dict[str, Value]:
    """Parameters of the firmware in a TOML file, choices by name or number.

    estimator: the folder of the one whose own parameters they may be; by default the one in use.
    """
    known = param_list.entries(estimator=estimator)
    params: dict[str, Value] = {}
    for name, value in content.items():
        if name not in known:
            raise UserError(f"{path}: params.{name}: {param_list.no_such(name)}")
        if isinstance(value, str) and known[name].choices:
            value = int(param_list.number_of(value, known[name].choices, f"{path}: params.{name}"))
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise UserError(f"{path}: params.{name}: is {value!r}; a number is needed")
        if not math.isfinite(value):
            raise UserError(f"{path}: params.{name}: is {value}; a finite number is needed")
        params[name] = value
    return params


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; correct the name") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}; name a TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: not valid TOML: {error}; correct the syntax") from None
