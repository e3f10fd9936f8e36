"""The rules on includes refuse what goes against the layers and what goes in a circle."""

from __future__ import annotations

import graphlib

import pytest

from zerohertz.testing.include_rules import MAY_INCLUDE, check_cycles, check_layers

# One header of each folder that the rows below speak of.
HEADERS = (
    "firmware/parameters/parameters.h",
    "firmware/law/base/num.h",
    "firmware/law/measurement/measurement.h",
    "firmware/law/estimator/estimator.h",
    "firmware/law/estimator/hasegawa/observer.h",
    "firmware/law/mode/mode.h",
    "firmware/law/drive.h",
    "firmware/guard/guard.h",
    "firmware/sequence/sequence.h",
    "firmware/host/link.h",
    "firmware/unit/unit.h",
    "hal/include/hal_drive_io.h",
    "hal/include/hal_devices.h",
)


def write(root, files: dict[str, str]) -> None:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)


def refused(root, folder: str, include: str) -> list[str]:
    write(root, {**dict.fromkeys(HEADERS, ""), f"{folder}/x.c": f"\n#include {include}\n"})
    return check_layers(root)


@pytest.mark.parametrize(
    ("folder", "include"),
    [
        ("firmware/law/base", '"measurement.h"'),
        ("firmware/law/base", '"hal_drive_io.h"'),
        ("firmware/law/measurement", '"drive.h"'),
        ("firmware/law/mode", '"observer.h"'),
        ("firmware/law", '"sequence.h"'),
        ("firmware/guard", '"estimator.h"'),
        ("firmware/guard", '"drive.h"'),
        ("firmware/sequence", '"unit.h"'),
        ("firmware/host", '"estimator.h"'),
        ("firmware/host", '"drive.h"'),
        ("firmware/host", '"hal_drive_io.h"'),
        ("firmware/host", '"../law/mode/mode.h"'),
        ("hal/include", '"num.h"'),
        ("firmware/law/base", "<stdio.h>"),
        ("firmware/law/base", '"nowhere.h"'),
    ],
)
def test_an_include_against_the_direction_is_refused(tmp_path, folder, include):
    (breach,) = refused(tmp_path, folder, include)
    assert breach.startswith(f"{folder}/x.c:2: ")


@pytest.mark.parametrize(
    ("folder", "include"),
    [
        ("firmware/law/mode", '"mode.h"'),
        ("firmware/law/mode", '"base/num.h"'),
        ("firmware/law/estimator/hasegawa", '"estimator.h"'),
        ("firmware/law/estimator/voltage_model", '"estimator.h"'),
        ("firmware/law", '"measurement.h"'),
        ("firmware/guard", '"num.h"'),
        ("firmware/sequence", '"drive.h"'),
        ("firmware/host", '"parameters.h"'),
        ("firmware/host", '"hal_devices.h"'),
        ("firmware/unit", '"hal_drive_io.h"'),
        ("firmware/law/base", "<float.h>"),
    ],
)
def test_an_include_along_the_direction_is_fine(tmp_path, folder, include):
    assert refused(tmp_path, folder, include) == []


def test_a_folder_without_a_row_is_refused(tmp_path):
    write(tmp_path, {"firmware/law/misc/x.c": ""})
    assert check_layers(tmp_path) == [
        "firmware/law/misc/x.c:1: firmware/law/misc has no row in include_rules.MAY_INCLUDE"
    ]


def test_the_layers_have_no_cycle():
    # But the estimator's contract and its implementation, which are one room.
    rows = {
        folder.removesuffix("/*"): {other.removesuffix("/*") for other in others} - {folder}
        for folder, others in MAY_INCLUDE.items()
    }
    rows["firmware/law/estimator"].discard("firmware/law/estimator")
    graphlib.TopologicalSorter(rows).prepare()


@pytest.mark.parametrize("folder", ["firmware/law/mode", "hal/cortex_m", "host_sim"])
def test_an_include_cycle_is_told_file_by_file(tmp_path, folder):
    write(
        tmp_path,
        {
            f"{folder}/a.h": '#include "b.h"\n',
            f"{folder}/b.h": '#include "c.h"\n',
            f"{folder}/c.h": '#include "a.h"\n#include <a.h>\n',
            f"{folder}/a.c": '#include "a.h"\n',
        },
    )
    (breach,) = check_cycles(tmp_path)
    files = breach.split("include cycle: ")[1].split(" -> ")
    assert files[0] == files[-1]
    assert sorted(files[1:]) == [f"{folder}/{name}.h" for name in "abc"]
    assert "".join(file[-3] for file in files) in "abcabca"


def test_headers_of_one_name_in_two_ports_are_no_cycle(tmp_path):
    write(
        tmp_path,
        {
            "hal/one/board.h": '#include "pins.h"\n',
            "hal/one/pins.h": "",
            "hal/two/board.h": "",
            "hal/two/pins.h": '#include "board.h"\n',
        },
    )
    assert check_cycles(tmp_path) == []
