"""The envelope to look at: one HTML page with pictures, and the traces of the worst runs."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from zerohertz import sim
from zerohertz.envelope import campaign
from zerohertz.envelope.axes import AXES
from zerohertz.envelope.campaign import MEASURES, Result, Row
from zerohertz.envelope.page import measures, table, worst
from zerohertz.envelope.run import Planned, run_case
from zerohertz.report import style

EVERY = 25  # rows of a kept trace: 5 ms
COLUMNS = 4
WIDTH_PX = 1500
# The best that a run can be comes first; a colour and a name each.
CLASSES = {
    "held": "#009E73",
    "not held": "#F0E442",
    "false trip": "#E69F00",
    "undeclared harm": "#B2182B",
}
_PANELS = (
    (("speed_ref_rpm", "speed_rpm", "speed_hat_rpm"), "min⁻¹"),
    (("load_Nm", "torque_Nm"), "Nm"),
    (("i_abs_A", "i_q_A"), "A"),
    (("flux_angle_err_deg",), "deg"),
)
_COLOURS = (style.REFERENCE, style.TRUE, style.ESTIMATE)


def class_of(row: Row) -> str:
    if row["undeclared_harm"]:
        return "undeclared harm"
    if row["false_trip"]:
        return "false trip"
    return "held" if row["held"] else "not held"


def write(folder: Path, result: Result, traces: Sequence[Path], command: str) -> Path:
    """envelope.html."""
    rows = result.possible
    parts = [
        f"<h1>The envelope</h1><p>{html.escape(command)}: {len(result.rows)} runs, "
        f"{len(result.impossible)} of them ask for the impossible and count apart.</p>",
        _html_table(table([("all", rows)])),
        _html_table(measures(rows)),
        "<h2>Outcome by axis</h2>",
        _svg(axes_picture(rows, style.svg)),
        "<h2>Quantiles</h2>",
        _svg(_quantile_picture(rows)),
        "<h2>The worst</h2>",
        _html_table(worst(result)),
        *(path.read_text(encoding="utf-8") for path in traces),
    ]
    path = folder / "envelope.html"
    look = "body{font-family:sans-serif;max-width:1200px;margin:auto}td,th{padding:2px 10px}"
    text = "\n".join(parts)
    page = f"<!doctype html><meta charset=utf-8><title>Envelope</title><style>{look}</style>{text}"
    path.write_text(page, encoding="utf-8")
    return path


def write_rows(folder: Path, result: Result) -> Path:
    """envelope.parquet: every row."""
    path = folder / "envelope.parquet"
    pq.write_table(pa.Table.from_pylist(result.rows), path)
    return path


def keep_trace(folder: Path, plan: Planned, record: sim.Record, row: Row) -> Path:
    """Parquet of every column, and the picture as SVG."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"run-{plan.case.index:06d}"
    columns = {key: np.asarray(values[::EVERY]) for key, values in record.columns.items()}
    pq.write_table(pa.table(columns), folder / f"{name}.parquet")
    path = folder / f"{name}.svg"
    path.write_bytes(_trace_picture(plan, record, row))
    return path


def keep_worst(folder: Path, result: Result) -> list[Path]:
    """The worst runs once more, each with its trace."""
    found = []
    for row in result.worst:
        _, plan, record = run_case(result.sample.case(row["index"]))
        found.append(keep_trace(folder, plan, record, row))
    return found


def _trace_picture(plan: Planned, record: sim.Record, row: Row) -> bytes:
    t = record.t_s[::EVERY]
    with style.figure(11.0, 6.5) as drawn:
        all_axes = drawn.subplots(len(_PANELS), 1, sharex=True)
        for axes, (names, unit) in zip(all_axes, _PANELS, strict=True):
            for name, colour in zip(names, _COLOURS, strict=False):
                axes.plot(t, record[name][::EVERY], color=colour, label=name.rpartition("_")[0])
            axes.set_ylabel(unit)
            axes.legend(loc="upper right", ncols=len(names))
        top = 1.3 * max(abs(rpm) for _, rpm in plan.mission.speed) + 200.0
        all_axes[0].set_ylim(-top, top)
        all_axes[-1].set_xlabel("s")
        drawn.suptitle(_trace_title(plan, row), x=0.01, ha="left", fontsize=9)
        return style.svg(drawn)


def _trace_title(plan: Planned, row: Row) -> str:
    case = plan.case
    said = f"{row['verdict']} {row['harm']} {row['fault']}".replace("_", " ").strip()
    names = ("motor", "mission", "inverter", "voltage", "J_ratio", "J_told", "load_pu", "Rs_ratio")
    shown = ", ".join(_short(name, case.values[name]) for name in names)
    return f"run {case.index}: {said}\n{shown}"


def _short(name: str, value: Any) -> str:
    return f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"


def write_png(path: Path, result: Result) -> None:
    """The outcome by axis, for the committed page."""
    path.write_bytes(axes_picture(result.possible, lambda drawn: style.png(drawn, WIDTH_PX)))


def axes_picture(rows: Sequence[Row], form: Callable[[Any], bytes]) -> bytes:
    """Of every axis the outcome of its runs, stacked."""
    lines = -(-len(AXES) // COLUMNS)
    with style.figure(12.0, 1.9 * lines) as drawn:
        all_axes = drawn.subplots(lines, COLUMNS, squeeze=False).ravel()
        for axes, axis in zip(all_axes, AXES, strict=False):
            found = campaign.parts(axis, rows)
            base = np.zeros(len(found))
            tilt = 20 if len(found) <= campaign.BINS else 60
            for name, colour in CLASSES.items():
                counts = [sum(class_of(row) == name for row in part) for _, part in found]
                share = 100.0 * np.array(counts) / [len(part) for _, part in found]
                axes.bar(range(len(found)), share, bottom=base, color=colour, label=name)
                base += share
            axes.set_xticks(
                range(len(found)), [text for text, _ in found], rotation=tilt, fontsize=6
            )
            axes.set_ylim(0.0, 100.0)
            style.panel_title(axes, axis.name)
        for axes in all_axes[len(AXES) :]:
            axes.set_visible(False)
        handles, labels = all_axes[0].get_legend_handles_labels()
        drawn.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        return form(drawn)


def _quantile_picture(rows: Sequence[Row]) -> bytes:
    with style.figure(12.0, 3.0) as drawn:
        all_axes = drawn.subplots(1, len(MEASURES))
        for axes, name in zip(all_axes, MEASURES, strict=True):
            values = sorted(row[name] for row in rows if row[name] is not None)
            axes.plot(values, 100.0 * (np.arange(len(values)) + 0.5) / max(len(values), 1))
            axes.set_xscale("symlog", linthresh=1e-3 if name.endswith("pu") else 0.1)
            style.panel_title(axes, name)
        all_axes[0].set_ylabel("% of runs")
        return style.svg(drawn)


def _svg(content: bytes) -> str:
    return content.decode()


def _html_table(markdown: str) -> str:
    return "<table>" + "".join(_html_rows(markdown.splitlines())) + "</table>"


def _html_rows(lines: Sequence[str]) -> Iterator[str]:
    for k, line in enumerate(lines):
        if k != 1:  # the rule below the heads
            tag = "th" if k == 0 else "td"
            cells = line.strip("| ").split(" | ")
            yield "<tr>" + "".join(f"<{tag}>{html.escape(c)}</{tag}>" for c in cells) + "</tr>"
