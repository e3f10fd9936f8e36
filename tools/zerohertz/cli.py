"""Command line of the tools: `tools/zh COMMAND`."""

from __future__ import annotations

import importlib
import inspect
import sys

import typer

from zerohertz import __version__
from zerohertz.console import short_paths
from zerohertz.errors import UserError
from zerohertz.paths import INSTALLED, need_checkout

# Each feature brings one module with `register(app)`. The order is that of the help.
COMMAND_MODULES = (
    "zerohertz.report.command",
    "zerohertz.scenario.command",
    "zerohertz.atlas.detection_command",
    "zerohertz.atlas.command",
    "zerohertz.atlas.special_command",
    "zerohertz.atlas.ensembles_command",
    "zerohertz.modes.command",
    "zerohertz.gain_design.command",
    "zerohertz.check.command",
    "zerohertz.configuration.command",
    "zerohertz.bringup.command",
    "zerohertz.commission.command",
    "zerohertz.stability.command",
    "zerohertz.replay.command",
    "zerohertz.site.command",
    "zerohertz.link.command",
    "zerohertz.link.run_command",
    "zerohertz.flight.command",
    "zerohertz.studio.command",
    "zerohertz.image.command",
    "zerohertz.image.params",
    "zerohertz.flash.command",
    "zerohertz.update.command",
    "zerohertz.bench.command",
    "zerohertz.golden.command",
    "zerohertz.testing.command",
    "zerohertz.campaign.command",
    "zerohertz.envelope.command",
    "zerohertz.estimators.command",
    "zerohertz.arena.command",
    "zerohertz.release.command",
)

# They build images, pages or tests from sources, which the installed package has not.
NEED_CHECKOUT = (
    "bench",
    "build",
    "campaign",
    "flash",
    "fmu",
    "new",
    "pil",
    "release",
    "site",
    "test",
    "update",
    "wheel",
)

# Packages that tools/zh adds when a command needs them, and the requirements-NAME.txt they are in.
LIST_OF = {
    "clarabel": "design",
    "scipy": "design",
    "matplotlib": "draw",
    "PIL": "draw",
    "dask": "campaign",
    "distributed": "campaign",
    "plotly": "campaign",
    "pyarrow": "campaign",
    "asammdf": "mdf",
    "playwright": "test",
    "mkdocs": "site",
    "scikit_build_core": "wheel",
    "fmpy": "fmi",
}
# The extras of the installed package (pyproject.toml) with what is in those lists.
EXTRA_OF = {"design": "design", "draw": "plots", "campaign": "bench"}
_OF_STUDIO = ("serial", "tornado")

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def make_app() -> typer.Typer:
    """All commands in one application."""
    app = typer.Typer(
        name="zh",
        help="ZeroHertz: sensorless induction-motor drive down to zero hertz.\n\n"
        "Start with `zh demo`: it installs what is missing, builds, runs the paper's experiments "
        "and writes a report. `zh setup` installs what any command needs. `zh python` runs a "
        "script that imports the package `zerohertz`.",
        epilog="Exit codes: 0 success, 1 a check failed, 2 bad input, 130 interrupted.",
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # markup would swallow whatever stands in square brackets
        context_settings={"help_option_names": ["-h", "--help"]},
    )

    @app.callback()
    def root(
        version: bool = typer.Option(
            False, "--version", is_eager=True, callback=_print_version, help="Show the version."
        ),
    ) -> None:
        pass

    for name in COMMAND_MODULES:
        importlib.import_module(name).register(app)
    _list_whole_summaries(app)
    return app


def _list_whole_summaries(app: typer.Typer) -> None:
    """In the list of commands typer would cut a summary at the end of the line."""
    for command in app.registered_commands:
        summary = (inspect.getdoc(command.callback) or "").split("\n\n")[0]
        command.short_help = " ".join(summary.split())
    for group in app.registered_groups:
        _list_whole_summaries(group.typer_instance)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"zerohertz {__version__}")
        raise typer.Exit


def _remedy(module: str) -> str | None:
    """What installs this module; None for one that every installation has."""
    if not INSTALLED:
        return f"tools/zh setup {LIST_OF[module]}" if module in LIST_OF else None
    extra = EXTRA_OF.get(LIST_OF.get(module, ""), "studio" if module in _OF_STUDIO else None)
    return f"pip install 'zerohertz[{extra}]'" if extra else f"pip install {module}"


def main() -> None:
    """Run one command; a mistake of the user becomes one line and exit code 2."""
    if sys.argv[1:] in ([], ["help"]):
        sys.argv[1:] = ["--help"]
    try:
        if sys.argv[1] in NEED_CHECKOUT:
            need_checkout(f"zh {sys.argv[1]}")
        code = make_app()(prog_name="zh", standalone_mode=False)
    except (UserError, typer.TyperException) as error:
        # Of an error of usage (no such option, value missing) only typer knows the whole text.
        text = error.format_message() if isinstance(error, typer.TyperException) else str(error)
        print("error: " + short_paths(" ".join(text.split())), file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
    except ModuleNotFoundError as error:
        remedy = _remedy((error.name or "").split(".")[0])
        if remedy is None:
            raise
        print(f"error: {error.name}: not installed; run {remedy}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
    except (KeyboardInterrupt, typer.Abort):
        code = EXIT_INTERRUPTED
    except BrokenPipeError:
        # The reader (head, less) has seen enough.
        sys.stderr.close()
        sys.exit(0)
    if code == EXIT_INTERRUPTED:  # typer turns Ctrl-C into this number, without a word
        print("error: interrupted", file=sys.stderr)
    sys.exit(code if type(code) is int else 0)
