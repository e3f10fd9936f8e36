"""What the page says of parameters, faults, states and signals: from the firmware's own lists."""

from __future__ import annotations

import json
import re
from pathlib import Path

from zerohertz import param_list
from zerohertz.drive import State
from zerohertz.image import fault_page
from zerohertz.link.recording import unit_of
from zerohertz.paths import ROOT

_SIGNALS = ROOT / "firmware" / "unit" / "signal_list.def"
_SUPERVISOR = ROOT / "firmware" / "law" / "confidence" / "supervisor.h"
_FILES = (*param_list.FILES, _SIGNALS, _SUPERVISOR, fault_page.LIST)

_SIGNAL = re.compile(r'^SIGNAL_[FUOX]+\(\s*(\w+),(?:[^"]|\n)*?"([^"]*)"\)', re.MULTILINE)
_REASON = re.compile(r"^#define SUPERVISOR_(\w+)\s+\(1u << (\d+)\)\s*/\* (.*?) \*/", re.MULTILINE)


def files() -> tuple[Path, ...]:
    """What the catalogue is made of."""
    return (*_FILES, param_list.FOLDER / "param_groups.def", Path(__file__))


def catalogue() -> dict[str, object]:
    """All texts, ready for JSON."""
    return {
        "parameters": {name: entry.text for name, entry in param_list.entries().items()},
        "groups": dict(param_list.groups().values()),
        "states": {int(state): state.name for state in State},
        "faults": {
            entry.bit: {
                "name": entry.name,
                "reaction": entry.reaction,
                "text": entry.text,
                "cause": entry.cause,
                "remedy": entry.remedy,
            }
            for entry in fault_page.entries()
        },
        "reasons": {
            int(bit): {"name": name, "text": text}
            for name, bit, text in _REASON.findall(_SUPERVISOR.read_text(encoding="utf-8"))
        },
        "signals": {
            name: {"text": text, "unit": unit_of(name)}
            for name, text in _SIGNAL.findall(_SIGNALS.read_text(encoding="utf-8"))
        },
    }


def script() -> str:
    """As a script: a page that is opened from a folder cannot fetch a file beside it."""
    return f"window.zhCatalog = {json.dumps(catalogue(), ensure_ascii=False)};\n"
