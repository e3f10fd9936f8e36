"""The FMUs of `zh fmu`: library, description and resources in one archive each."""

from __future__ import annotations

import hashlib
import importlib.util
import subprocess
import uuid
import zipfile
from pathlib import Path

from zerohertz.board import read_board
from zerohertz.build import PRESET, STAMP, ensure_built
from zerohertz.drive import Drive, override_lines, parameters
from zerohertz.paths import BUILD, ROOT, need_checkout
from zerohertz.release.fmu_description import Unit, describe, variables
from zerohertz.scenario.setup import Setup, load_setup

HEADERS = BUILD / PRESET / "fmi"  # ZH_FMI_HEADERS of host_sim/CMakeLists.txt
SEED = 1
_PLATFORM = {2: "linux64", 3: "x86_64-linux"}
_EPOCH = (2000, 1, 1, 0, 0, 0)  # the same bytes whenever it is made
_UNITS = (
    ("zerohertz_drive", "ZeroHertz drive: ADC words or amperes and volts in, duties out", False),
    ("zerohertz_drive_plant", "ZeroHertz drive with inverter, motor and sensors", True),
)


def build_fmus(into: Path, config: str) -> list[Path]:
    """The drive, and drive with plant, for FMI 2.0 and for FMI 3.0."""
    need_checkout("an FMU")
    put_headers()
    library = _stripped(ensure_built("zh_fmu").library("zh_fmu"), into)
    setup = load_setup(config)
    made = [
        _archive(
            into / f"{name}_fmi{version}.fmu",
            version,
            _unit(name, text, plant, setup),
            setup,
            library,
        )
        for name, text, plant in _UNITS
        for version in _PLATFORM
    ]
    library.unlink()
    return made


def put_headers() -> None:
    """The standard's headers, which fmpy brings; the build is configured anew for them."""
    spec = importlib.util.find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("fmpy", name="fmpy")
    HEADERS.mkdir(parents=True, exist_ok=True)
    for header in sorted((Path(spec.origin).parent / "c-code").glob("fmi[23]*.h")):
        copy = HEADERS / header.name
        if not copy.is_file() or copy.read_bytes() != header.read_bytes():
            copy.write_bytes(header.read_bytes())
            (BUILD / PRESET / STAMP).unlink(missing_ok=True)


def _stripped(library: Path, into: Path) -> Path:
    """Without debug information: a sixth of the size."""
    copy = into / library.name
    subprocess.run(("strip", "--strip-unneeded", "-o", copy, library), check=True)
    return copy


def _unit(name: str, text: str, plant: bool, setup: Setup) -> Unit:
    token = hashlib.sha256(f"{name} {setup.name}".encode()).digest()[:16]
    step_s = read_board(setup.board).period_s
    return Unit(name, text, f"{{{uuid.UUID(bytes=token)}}}", plant, step_s)


def _archive(path: Path, version: int, unit: Unit, setup: Setup, library: Path) -> Path:
    with Drive(setup.motor_dir, setup.board, setup.params) as drive:
        listed = parameters()
        values = {entry.name: drive[entry.name] for entry in listed}
    content = {
        "modelDescription.xml": describe(version, unit, variables(listed, values, unit.plant)),
        f"binaries/{_PLATFORM[version]}/{unit.identifier}.so": library.read_bytes(),
        "documentation/licenses/LICENSE": (ROOT / "LICENSE").read_bytes(),
        **{f"resources/{name}": data for name, data in _resources(unit, setup).items()},
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), data, zipfile.ZIP_DEFLATED)
    return path


def _resources(unit: Unit, setup: Setup) -> dict[str, bytes]:
    """What the library reads: fmu_settings.h."""
    board = read_board(setup.board)
    settings = {
        "plant": int(unit.plant),
        "seed": SEED,
        "adc_bits": board.adc_bits,
        "current_full_scale_A": board.current_full_scale_A,
        "line_voltage_full_scale_V": board.line_voltage_full_scale_V,
        "dc_link_full_scale_V": board.dc_link_full_scale_V,
    }
    lines = "".join(f"{name}={value!r}\n" for name, value in settings.items())
    files = {"board.toml": setup.board, "rig.toml": setup.rig}
    files |= {f"motor/{name}": setup.motor_dir / name for name in ("motor.toml", "l_gain.json")}
    return {
        "settings.txt": lines.encode(),
        "overrides.txt": override_lines(setup.params),
        **{name: path.read_bytes() for name, path in files.items()},
    }
