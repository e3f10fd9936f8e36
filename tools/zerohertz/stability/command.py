"""`zh stability`: where the whole sampled loop is stable, and where it has an operating point."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Annotated

import typer

from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.options import Json
from zerohertz.paths import BUILD, ROOT

PLANES = ("frequency", "speed")
DEFAULT_OUT = BUILD / "stability"
NO_TABLE = "none"


@dataclasses.dataclass(frozen=True)
class Request:
    """What is asked, checked."""

    config: str
    plane: str
    rs_ratios: tuple[float, ...]
    rr_ratio: float
    m_ratio: float
    leakage_ratio: float
    rs_hat: float | None
    frequency_Hz: float
    torque_pu: float
    cells: tuple[int, int]


ConfigOption = Annotated[
    str, typer.Option(help="Configuration: a name in host_sim/configs, or a TOML file.")
]
TableOption = Annotated[
    str | None,
    typer.Option(
        metavar="DIR|none",
        help="Gain table: a folder of gain_tables, or none for L = 0. "
        "Default: the configuration's.",
    ),
]
PlaneOption = Annotated[
    str,
    typer.Option(help="frequency: stator frequency x torque; speed: the atlas' speeds x loads."),
]
RsRatioOption = Annotated[
    list[float] | None,
    typer.Option(
        metavar="R",
        help="True Rs over nameplate Rs, one panel each. Default: .67 .8 1 1.25 1.5.",
    ),
]
FirmwareRsOption = Annotated[
    float | None,
    typer.Option(
        metavar="R",
        help="Firmware Rs over true Rs. Default: nameplate Rs; with rs_measure: rs_bias.",
    ),
]
CurrentOption = Annotated[
    float | None, typer.Option("--i-d", help="Magnetising current, A (parameter i_d_A).")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Firmware parameter; overrides all else."),
]
CellsOption = Annotated[str, typer.Option(metavar="NxM", help="Grid size: frequencies x torques.")]
PngOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Picture to write. Default: build/stability/<config>.png."),
]
HtmlOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Zoomable page to write. Default: the same name with .html."),
]
CompareOption = Annotated[
    Path | None,
    typer.Option(
        metavar="ATLAS.parquet",
        help="Instead, compare with the runs of an atlas; exit 1 below 95 % agreement.",
    ),
]


DwellOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.png",
        help="Instead, draw what a modulation reveals at 0 Hz stator frequency, 30 min^-1.",
    ),
]


def register(app: typer.Typer) -> None:
    app.command("stability")(stability)


def stability(
    config: ConfigOption = "recommended",
    table: TableOption = None,
    plane: PlaneOption = "frequency",
    rs_ratio: RsRatioOption = None,
    rr_ratio: Annotated[float, typer.Option(help="True Rr over nameplate Rr.")] = 1.0,
    m_ratio: Annotated[float, typer.Option(help="True M over nameplate M.")] = 1.0,
    leakage_ratio: Annotated[
        float, typer.Option(help="True leakage over nameplate leakage.")
    ] = 1.0,
    firmware_rs: FirmwareRsOption = None,
    i_d: CurrentOption = None,
    override: SetOption = None,
    frequency: Annotated[float, typer.Option(help="Largest stator frequency, Hz.")] = 6.0,
    torque: Annotated[float, typer.Option(help="Largest torque, % of rated.")] = 150.0,
    cells: CellsOption = "61x31",
    png: PngOption = None,
    html: HtmlOption = None,
    compare: CompareOption = None,
    dwell: DwellOption = None,
    as_json: Json = False,
) -> None:
    """Linearise motor, firmware and shaft at each operating point, and map where they are stable.

    The firmware uses nameplate values; the true motor differs. Each point is an equilibrium of the
    drive with these errors, continued from the error-free one until it ceases to exist. "oriented"
    is a stable point with flux angle within 25 degrees, flux magnitude within 25 % and speed within
    30 min^-1. Method: tools/zerohertz/stability/README.md.
    """
    if dwell is not None:
        _dwell(dwell, 5.1 if i_d is None else i_d, as_json)
        return
    changes = _assignments(override or [])
    if i_d is not None:
        changes["i_d_A"] = _in_range(i_d, "--i-d", 0.01, 1e4)
    folder = _table(table, changes)
    asked = Request(
        config=config,
        plane=_choice(plane),
        rs_ratios=tuple(_ratio(r, "--rs-ratio") for r in rs_ratio or (0.67, 0.8, 1.0, 1.25, 1.5)),
        rr_ratio=_ratio(rr_ratio, "--rr-ratio"),
        m_ratio=_ratio(m_ratio, "--m-ratio"),
        leakage_ratio=_ratio(leakage_ratio, "--leakage-ratio"),
        rs_hat=None if firmware_rs is None else _ratio(firmware_rs, "--firmware-rs"),
        frequency_Hz=_in_range(frequency, "--frequency", 0.01, 200.0),
        torque_pu=_in_range(torque, "--torque", 1.0, 400.0) / 100.0,
        cells=_cells(cells),
    )
    if compare is not None:
        _compare(asked, folder, changes, compare, as_json)
        return
    stem = DEFAULT_OUT / f"{Path(config).stem}{'_' + folder.name if folder else ''}"
    _map(asked, folder, changes, (png or stem.with_suffix(".png"), html), as_json)


def _dwell(path: Path, i_d_A: float, as_json: bool) -> None:
    from zerohertz.stability import dwell

    numbers = dwell.write_picture(path, 30.0, i_d_A, 2.0)
    tell(f"written: {short_paths(path)}")
    if as_json:
        print(json.dumps(numbers))
    else:
        print("\n".join(f"{name}: {value:.3g}" for name, value in numbers.items()))


def _map(
    asked: Request,
    table: Path | None,
    changes: dict[str, float],
    files: tuple[Path, Path | None],
    as_json: bool,
) -> None:
    from zerohertz.scenario.setup import load_setup
    from zerohertz.stability import maps, picture, plane

    fw = plane.firmware_of(load_setup(asked.config), table, changes)
    with progress_bar("operating points", maps.count(asked)) as progress:
        shown = maps.make(fw, asked, progress)
    png, html = files[0], files[1] or files[0].with_suffix(".html")
    for path, write in ((png, picture.write_png), (html, picture.write_html)):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write(path, shown)
        except OSError as error:
            raise UserError(f"{path}: cannot be written: {error.strerror}; name another") from None
        tell(f"written: {short_paths(path)}")
    if as_json:
        print(json.dumps(maps.as_json(shown, asked)))
    else:
        print("\n".join(maps.table(shown)))


def _compare(
    asked: Request, table: Path | None, changes: dict[str, float], path: Path, as_json: bool
) -> None:
    from zerohertz.scenario.setup import load_setup
    from zerohertz.stability import compare, plane

    rows = compare.read(path)
    fw = plane.firmware_of(load_setup(asked.config), table, changes)
    with progress_bar("operating points", len(rows["started"])) as progress:
        found = compare.compare(fw, rows, progress)
    if as_json:
        agreement = found.agreement if found.judged else None
        print(json.dumps(dataclasses.asdict(found) | {"agreement": agreement}))
    else:
        for row in found.rows:
            print("  ".join(f"{key} {value}" for key, value in row.items()))
        print(
            f"{found.points} points, {found.judged} judged by both ({found.not_started} never "
            f"started, {found.not_linear} with saturation or drift): "
            f"{found.agree} agree, {100.0 * found.agreement:.1f} %"
        )
    if not found.agreement >= 0.95:
        raise typer.Exit(1)


def _table(text: str | None, changes: dict[str, float]) -> Path | None:
    if text is None:
        return None
    if text == NO_TABLE:
        changes["observer_gain_enable"] = 0
        return None
    folder = Path(text) if Path(text).is_dir() else ROOT / "gain_tables" / text
    if not (folder / "l_gain.json").is_file():
        raise UserError(f"--table: {text}: no such gain table; name a folder with an l_gain.json")
    changes["observer_gain_enable"] = 1
    return folder


def _assignments(texts: list[str]) -> dict[str, float]:
    found = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        try:
            found[name] = float(value)
        except ValueError:
            raise UserError(f"--set: '{text}' is not NAME=VALUE with a number") from None
    return found


def _choice(text: str) -> str:
    if text not in PLANES:
        raise UserError(f"--plane: '{text}'; known are {', '.join(PLANES)}")
    return text


def _ratio(value: float, option: str) -> float:
    return _in_range(value, option, 0.1, 10.0)


def _in_range(value: float, option: str, low: float, high: float) -> float:
    if not (math.isfinite(value) and low <= value <= high):
        raise UserError(f"{option}: is {value:g}; give {low:g} .. {high:g}")
    return value


def _cells(text: str) -> tuple[int, int]:
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdigit() and 2 <= int(p) <= 400 for p in parts):
        raise UserError(f"--cells: '{text}' is not NxM with numbers of 2 .. 400")
    return int(parts[0]), int(parts[1])
