"""The report: one self-contained HTML page from results and pictures."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from html import escape

from zerohertz.paths import ROOT
from zerohertz.report import html
from zerohertz.report.chart import Chart
from zerohertz.report.experiments import EXPERIMENTS, GROUPS, SITUATIONS, Group, observed
from zerohertz.report.tables import TableOutcome
from zerohertz.scenario.evaluate import Result, score_by_eye
from zerohertz.scenario.setup import Setup

DOCS = ROOT / "tools" / "docs"


@dataclasses.dataclass(frozen=True)
class Report:
    """All that is shown."""

    paper: Setup
    results: Sequence[Result]  # the thirteen figures
    pictures: Mapping[str, Chart]  # "6" ... "18", names of situations, "fig04", "gamma"
    recommended: Setup | None
    situations: Sequence[Result]
    tables: Sequence[TableOutcome]
    sensitivity: Mapping[str, float] | None
    sensitivity_source: str
    versions: Sequence[tuple[str, str]]


def build_page(report: Report) -> str:
    """The whole document."""
    parts = [
        _top(report),
        _recommended(report),
        _atlas(),
        _paper(report),
        _verdicts(report),
        *(_group(report, group) for group in GROUPS),
        _design(report),
        _robustness(report),
        _configuration(report),
        _reproduce(report),
    ]
    return html.page("ZeroHertz: induction-motor drive without a speed sensor", "\n".join(parts))


def _top(report: Report) -> str:
    links = (
        ("recommended", "Recommended drive"),
        ("atlas", "Atlas"),
        ("paper", "The paper's experiments"),
        ("design", "Observer design"),
        ("robustness", "Robustness"),
        ("configuration", "Rig and tuning"),
        ("reproduce", "Reproduce"),
    )
    nav = "".join(f'<a href="#{name}">{text}</a>' for name, text in links)
    held = sum(result.match for result in report.situations)
    matched = sum(result.match for result in report.results)
    proven = sum(table.holds for table in report.tables)
    scores = "\n".join(
        f'<a class="score" href="#{name}"><b>{good} of {len(every)}</b>{text}</a>'
        for name, good, every, text in (
            ("recommended", held, report.situations, "situations held"),
            ("design", proven, report.tables, "gain tables proven"),
            ("paper", matched, report.results, "figures of the paper match"),
        )
    )
    return f"""
<h1>An induction motor without a speed sensor, through zero frequency</h1>
<p class="lead">The ZeroHertz firmware, compiled for the host, controls a simulated copy of the test
rig of Hasegawa (2005): a 1.5 kW induction motor, 5 kHz inverter, 14-bit sensors. Everything on this
page is simulation: nothing here has turned a real motor yet.</p>
<div class="strip">
{scores}
</div>
<nav>{nav}</nav>"""


def _atlas() -> str:
    picture = html.image(
        DOCS / "atlas.png", "Maps of speed and load for five true stator resistances, three tunings"
    )
    return (
        '<h2 id="atlas">Atlas: what the drive holds</h2><p>Each mark is a run. Speed goes to the '
        "right, load upwards; the five panels differ in how wrong the firmware's stator resistance "
        "is. Green holds the speed with the flux oriented, red is lost. Rows: L = 0, the paper's "
        "tuning, the recommended one.</p>"
        f'<div class="wide picture">{picture}</div>'
        '<p class="small">Not computed for this report: committed result of <code>tools/zh atlas '
        "--compare no_gain paper recommended --write</code>. A point becomes a run by a click in "
        "the simulator of <code>tools/zh site</code>.</p>"
    )


def _paper(report: Report) -> str:
    matched = sum(result.match for result in report.results)
    chips = "\n".join(
        f'<a class="chip {"yes" if r.match else "no"}" href="#fig{r.key}">'
        f"<b>{r.key}</b><span>{'✓ match' if r.match else '✗ no'}</span></a>"
        for r in report.results
    )
    return f"""
<h2 id="paper">Thirteen experiments of the paper</h2>
<p>One rig and one tuning for Figs. 6–18 of the paper; the outcomes to reproduce were fixed before
the firmware existed.</p>
<div class="strip"><div class="score"><b>{matched} of {len(report.results)}</b>figures match</div>
<div class="score"><b>{score_by_eye(report.results)} of {len(report.results)}</b>by eye</div>
{chips}</div>
<p class="small">A figure matches when its predicate holds for every noise seed with 2 % margin on
every threshold. By eye is a stricter reading of its own.</p>"""


def _verdicts(report: Report) -> str:
    rows = []
    for result in report.results:
        e = EXPERIMENTS[int(result.key)]
        rows.append(
            (
                f'<a href="#fig{result.key}"><b>{result.key}</b></a>',
                escape(e.L),
                escape(e.eps1),
                escape(e.load),
                escape(e.observer_Rs),
                escape(e.paper),
                escape(observed(result.worst.measured)),
                html.badge(result.match),
                _seeds(result),
                html.badge(result.match_by_eye, "agrees", "does not"),
                escape(short_reason(result)),
            )
        )
    header = (
        *("Fig.", "L", "ε₁", "load", "observer Rs", "the paper shows", "ours, worst seed"),
        *("verdict", "seeds", "by eye", "why not"),
    )
    return (
        '<h2 id="verdicts">Verdicts: the paper and ours</h2>'
        + html.table(header, rows, numeric=(8,))
        + '<p class="small">“ours” describes the seed with the least margin; the plots below show '
        "seed 1. Ripple is the rms after a 0.5 Hz high-pass from 8 s to 30 s after the step. “By "
        "eye” asks more: the estimate is sane before the step, what is lost is not regained, "
        "estimate and shaft agree where the drive holds.</p>"
    )


def short_reason(result: Result, shown: int = 2) -> str:
    """The clauses that are farthest from holding; all of them stand beside the picture."""
    if result.match:
        return f"by eye: {result.reason_by_eye}" if result.reason_by_eye else ""
    failing = sorted(result.worst.failing, key=lambda clause: clause.margin)
    more = f"; {len(failing) - shown} more" if len(failing) > shown else ""
    return _stays_stable(result) + "; ".join(str(clause) for clause in failing[:shown]) + more


def _stays_stable(result: Result) -> str:
    """Where losing the speed is asked for, the clause is only the alternative nearest to it."""
    return "does not lose the speed; nearest to it " if result.predicate == "UNSTABLE" else ""


def _seeds(result: Result) -> str:
    return f"{result.seeds_matched}/{len(result.judgements)}"


def _group(report: Report, group: Group) -> str:
    by_key = {result.key: result for result in report.results}
    cards = [_card(report, by_key[str(n)]) for n in group.figures if str(n) in by_key]
    return f'<h2>{escape(group.title)}</h2><p>{escape(group.text)}</p><div class="grid">' + (
        "\n".join(cards) + "</div>"
    )


def _card(report: Report, result: Result) -> str:
    e = EXPERIMENTS[int(result.key)]
    settings = f"L {'= 0' if e.L == '0' else e.L} · ε₁ {e.eps1} · load {e.load}"
    if e.observer_Rs != "nominal":
        settings += f" · observer Rs {e.observer_Rs}"
    content = (
        f'<div class="set">{escape(settings)}</div>'
        + _picture(report, result.key, f"Fig. {result.key}: speed, torque current, frequency")
        + html.definitions([("paper", escape(e.paper)), *_told(result, "predicate", "match")])
    )
    badge = html.badge(result.match)
    return html.card(f"Fig. {result.key}", badge, result.match, content, f"fig{result.key}")


def _told(result: Result, wanted: str, verb: str) -> list[tuple[str, str]]:
    """What is said below a picture."""
    margin = _margin(result)
    told = [
        ("seed 1", escape(observed(result.judgements[0].measured))),
        (wanted, escape(result.predicate)),
        ("seeds", f"{_seeds(result)} {verb}{margin}"),
    ]
    if result.by_eye:
        told.append(("by eye", escape(result.reason_by_eye or "agrees")))
    if result.reason:
        told.append(
            ("why not", f'<span class="why">{escape(_stays_stable(result) + result.reason)}</span>')
        )
    return told


def _margin(result: Result) -> str:
    """Nothing where the run's end is the threshold: held to the end has no distance to it."""
    margin = result.worst.margin
    return f"; least margin {_percent(margin)}" if margin != 0.0 else ""


def _percent(margin: float) -> str:
    return "far off" if margin < -10.0 else f"{100.0 * margin:+.1f} %".replace("-", "−")


def _picture(report: Report, key: str, alt: str) -> str:
    chart = report.pictures.get(key)
    return html.chart(chart.json(), alt) if chart else '<p class="small">no picture</p>'


def _recommended(report: Report) -> str:
    head = '<h2 id="recommended">Recommended drive</h2>'
    if report.recommended is None:
        return head + "<p>There is none in host_sim/configs yet.</p>"
    held = sum(result.match for result in report.situations)
    moving = html.image(
        DOCS / "zero_crossing.gif", "Speed, stator frequency and flux angle error in a passage"
    )
    cards = []
    for result in report.situations:
        title = SITUATIONS.get(result.key, result.key)
        content = _picture(report, result.key, title)
        content += html.definitions(_told(result, "wanted", "hold"))
        badge = html.badge(result.match, "held", "not held")
        cards.append(html.card(title, badge, result.match, content))
    return (
        f"{head}<p>The tuning to start from. It has to hold the four situations of the paper, "
        "which tell a drive that works at zero frequency from one that does not: "
        f"{held} of {len(report.situations)} held.</p>"
        f'<div class="wide picture moving">{moving}</div><p class="small">The passage under rated '
        "load, five times real time; committed result of <code>tools/zh animate</code>.</p>"
        '<p class="small">Drag across a plot to zoom, double-click for the whole; with the '
        "keyboard: arrows, +, −, 0. Zoomed, the vertical axis fits what is shown.</p>"
        f'<div class="grid">{"".join(cards)}</div>'
    )


def _design(report: Report) -> str:
    folder = escape(report.paper.motor_dir.name)
    rows = [
        (
            escape(t.motor),
            escape(t.method),
            str(t.entries),
            "–" if t.design_s is None else f"{t.design_s:.1f} s",
            _compared(t.difference),
            f"{t.certificate.proven} of {t.certificate.entries}",
            _or_none(t.certificate.max_gamma, ".3f"),
            _or_none(t.certificate.max_angle_deg, ".1f°"),
            f"{t.certificate.max_euler_radius:.4f}",
            f"{t.certificate.max_negative_gain_band_rad_s:.2g} rad/s",
        )
        for t in report.tables
    ]
    header = (
        *("motor", "method", "entries", "design, CPU", "fresh vs committed", "entries proven"),
        *("max γ", "2 atan γ", "max |1 + T s|", "negative-gain band"),
    )
    cards = (
        ("fig04", "Fig. 4: root loci of motor and observer"),
        ("gamma", "Bound of the field orientation over speed"),
    )
    plots = "".join(html.card(text, "", True, _picture(report, key, text)) for key, text in cards)
    return (
        '<h2 id="design">Observer design</h2><p>The gain L(ω) solves the linear matrix '
        "inequalities (14)–(17) of the paper at every speed. Each committed entry was proven in "
        "exact rational arithmetic by a program that shares no code with the design. <code>zh demo "
        "--design</code> also designs the tables afresh and compares. 2 atan γ "
        "bounds the error of field orientation for the speed error designed for. The experiments "
        f"above use the table of <code>gain_tables/{folder}</code>.</p>"
        + html.table(header, rows, numeric=tuple(range(2, 10)))
        + f'<div class="grid" style="margin-top:1rem">{plots}</div>'
    )


def _compared(difference: float | None) -> str:
    if difference is None:
        return "–"
    return "identical" if difference <= 0.0 else f"{difference:.1e}"


def _or_none(value: float | None, form: str) -> str:
    if value is None:
        return "–"
    unit = form[-1] if form.endswith("°") else ""
    return format(value, form.removesuffix("°")) + unit


def _robustness(report: Report) -> str:
    head = '<h2 id="robustness">How far the match reaches</h2>'
    if not report.sensitivity:
        return f"{head}<p>Not in this report: {escape(report.sensitivity_source)}.</p>"
    matched = sum(result.match for result in report.results)
    rows = [("none (this report)", str(matched))]
    rows += [(escape(k), f"{v:.2f}") for k, v in report.sensitivity.items()]
    return (
        f"{head}<p>Mean number of matching figures when all parameters of the rig are drawn at "
        "random around their values: 32 draws per spread, one noise seed, averaged inverter. Not "
        f"computed for this report: {escape(report.sensitivity_source)}.</p>"
        '<div style="max-width:30rem">'
        + html.table(("spread of all rig parameters (1 σ)", "figures matching, mean"), rows, (1,))
        + "</div>"
    )


def _configuration(report: Report) -> str:
    parts = ['<h2 id="configuration">Rig and tuning</h2>']
    for setup in (report.paper, report.recommended):
        if setup is None:
            continue
        tuning = "\n".join(f"{name} = {value}" for name, value in setup.params.items())
        parts.append(html.folded(f"{setup.name}: tuning of the firmware", tuning))
        for what, path in (("rig", setup.rig), ("board", setup.board)):
            text = path.read_text(encoding="utf-8")
            parts.append(html.folded(f"{setup.name}: {what} ({path.name})", text))
        motor = setup.motor_dir / "motor.toml"
        label = f"{setup.name}: motor data and gain design ({setup.motor_dir.name})"
        parts.append(html.folded(label, motor.read_text(encoding="utf-8")))
    return "\n".join(parts)


def _reproduce(report: Report) -> str:
    commands = (
        ("tools/zh demo", "this report"),
        ("tools/zh figures --config paper", "the verdicts of Figs. 6–18, all seeds"),
        ("tools/zh figures --config recommended", "the four situations"),
        ("tools/zh report --config paper --figure 18 --png fig18.png", "one figure as a picture"),
        ("tools/zh figures --config paper --sensitivity", "the spread of the rig"),
        ("tools/zh design --check", "fresh gain tables against the committed ones"),
        ("tools/zh certify --plot", "the proofs, Fig. 4 and γ"),
    )
    rows = [(f"<code>{escape(c)}</code>", escape(text)) for c, text in commands]
    made = "; ".join(f"{escape(name)} {escape(text)}" for name, text in report.versions)
    return (
        '<h2 id="reproduce">Reproduce</h2>'
        f"<p>In the folder of the checkout ({escape(ROOT.name)}):</p>"
        + html.table(("command", "gives"), rows)
        + f"<footer>Made by {made}. Speeds are mechanical unless said, currents power invariant; "
        "T_N = 8.4 Nm.</footer>"
    )
