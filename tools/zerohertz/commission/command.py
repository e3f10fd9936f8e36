"""`zh commission`: an unknown motor becomes motor.toml and parameters. `zh trial`: does it run?

`zh campaign commissioning`: both, for every motor of host_sim/rigs/motors.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from zerohertz.errors import UserError


def register(app: typer.Typer) -> None:
    """Add `zh commission` and `zh trial`."""
    app.command("commission")(commission)
    app.command("trial")(trial)


def register_campaign(campaign: typer.Typer) -> None:
    """Add `zh campaign commissioning`."""
    campaign.command("commissioning")(commissioning)


def commission(
    rig: Annotated[str, typer.Option(help="Name in host_sim/rigs/motors, or a file.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder, or its motor.toml, that receives the result.")
    ] = None,
    board: Annotated[
        Path | None, typer.Option(help="Board file; without it one of the motor's size.")
    ] = None,
    rotate: Annotated[
        bool, typer.Option("--rotate", help="Then turn the free shaft: inertia and friction.")
    ] = False,
    seed: Annotated[int, typer.Option(min=1, help="Of the sensors' noise.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Find a motor's circuit with the firmware at standstill, and derive all parameters.

    The rig's [nameplate] is all that is told: kW, V and A of the line (rms), Hz, min^-1, cos phi,
    star or delta. With --out: motor.toml for `zh design`, board.toml and firmware.toml. Exit 1 when
    the firmware refuses what it found.
    """
    # Here and not above: other commands need not wait for scipy.
    from zerohertz.commission import run as firmware
    from zerohertz.commission.folder import rig_file, store
    from zerohertz.commission.plate import read_plate, warnings
    from zerohertz.commission.rotate import find_mechanics
    from zerohertz.commission.solve import solve

    path = rig_file(rig)
    plate = read_plate(path)
    notes = Console(stderr=True)
    doubts = warnings(plate)
    for doubt in doubts:
        notes.print(f"warning: nameplate: {doubt}", highlight=False)
    found, seconds = firmware.commission(path, plate, board, seed)
    refusal = firmware.refused(found)
    answer = {"rig": path.stem, "seconds": seconds, "warnings": doubts, "refusal": refusal}
    answer["firmware"] = dataclasses.asdict(found)
    if refusal is not None:
        _show_refusal(answer, as_json)
        raise typer.Exit(1)
    motor = solve(found, plate)
    answer["motor"] = dataclasses.asdict(motor)
    if rotate:
        mechanics = find_mechanics(path, motor, plate, board, seed)
        answer["mechanics"] = dataclasses.asdict(mechanics)
        plate = dataclasses.replace(plate, J_kg_m2=mechanics.J_kg_m2)
    if out is not None:
        folder = out.parent if out.suffix == ".toml" else out
        store(folder, path.stem, motor, plate, board)
        notes.print(f"written to {folder}; next: tools/zh design {folder}", highlight=False)
    if as_json:
        print(json.dumps(answer))
        return
    c = motor.circuit
    if rotate:
        print(f"{path.stem}: J {mechanics.J_kg_m2:.4g} kg m2, friction", end=" ")
        print(f"{mechanics.friction_Nm:.2g} Nm")
    print(f"{path.stem}: found in {seconds:.0f} s at standstill")
    print(f"  Rs {c.Rs_ohm:.5g} ohm, Rr {c.Rr_ohm:.5g} ohm, sigma Ls {1e3 * c.sigma_Ls_H:.5g} mH")
    print(f"  Ls = Lr {1e3 * c.Ls_H:.5g} mH, M {1e3 * c.M_H:.5g} mH at {motor.main_flux_Wb:.4g} Wb")
    print(f"  rated flux takes i_d {motor.i_d_A:.4g} A, a leg loses {motor.lost_V:.3g} V")
    points = ", ".join(f"{psi:.3f} Wb at {i:.3g} A" for psi, i in motor.curve[1:])
    print(f"  magnetising curve (power invariant): {points}")


def _show_refusal(answer: dict[str, object], as_json: bool) -> None:
    print(json.dumps(answer) if as_json else f"{answer['rig']}: refused: {answer['refusal']}")


def trial(
    folder: Annotated[Path, typer.Argument(help="Folder of zh commission, with its table.")],
    rig: Annotated[str, typer.Option(help="Name in host_sim/rigs/motors, or a file.")],
    seed: Annotated[int, typer.Option(min=1, help="Of the sensors' noise.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Run a commissioned motor: a speed step, then rated load on and off. Exit 1 when not held."""
    from zerohertz.commission.folder import rig_file
    from zerohertz.commission.trial import run_trial

    if not (folder / "l_gain.json").exists():
        raise UserError(f"{folder}: has no l_gain.json; run tools/zh design {folder} first")
    seen = run_trial(folder, rig_file(rig), seed)
    if as_json:
        fields = {f.name: getattr(seen, f.name) for f in dataclasses.fields(seen)}
        print(json.dumps({key: value for key, value in fields.items() if key != "record"}))
    else:
        fault = f", fault bits {seen.fault:#x}" if seen.fault else ""
        print(f"{folder.name}: {seen.word}{fault}")
        print(f"  speed step to 90 % in {seen.rise_s:.2f} s; rated load takes", end=" ")
        print(f"{100.0 * seen.dip_pu:.1f} % of rated speed for a moment")
        print(f"  settled: speed off by {100.0 * seen.speed_err_pu:.2f} %", end=", ")
        print(f"flux angle by {seen.angle_err_deg:.1f} degrees")
    raise typer.Exit(0 if seen.held else 1)


def commissioning(
    motor: Annotated[
        list[str] | None, typer.Option(help="Names in host_sim/rigs/motors; default: all.")
    ] = None,
    seed: Annotated[int, typer.Option(min=1, help="Of the sensors' noise.")] = 1,
    write: Annotated[bool, typer.Option(help="Write tools/docs/commissioning.md.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Are motors found from their nameplates, and do they run with what follows from it?"""
    from zerohertz.commission import campaign
    from zerohertz.commission.folder import all_rigs

    if write and motor:
        raise UserError("--write: the page has every motor; leave out --motor")
    names = motor or [path.stem for path in all_rigs()]
    output = sys.stderr if as_json else sys.stdout
    rows = campaign.run_all(names, seed, lambda row: print(campaign.row_text(row), file=output))
    if write:
        campaign.PAGE.write_text(campaign.page_text(rows, seed), encoding="utf-8")
    if as_json:
        print(json.dumps({"seed": seed, "motors": [campaign.as_dict(row) for row in rows]}))
    raise typer.Exit(0 if all(row.good for row in rows) else 1)
