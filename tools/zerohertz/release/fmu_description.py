"""modelDescription.xml of the FMUs, from the list that the library is built from."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

from zerohertz import __version__
from zerohertz.drive import Access, Parameter
from zerohertz.paths import ROOT

LIST = ROOT / "host_sim" / "fmu" / "fmu_variables.def"
PARAMETER_FIRST = 1000  # FMU_PARAMETER_FIRST of fmu.h
STEP_S = 200e-6

_ENTRY = re.compile(
    r"^FMU_(INPUT|DRIVE_INPUT|PLANT_INPUT|OUTPUT|TRUTH)\((\d+), (\w+), (\w+),"
    r'(?: ([\d.]+),)? "([^"]*)", "([^"]*)"\)$',
    re.MULTILINE,
)
_TYPES = {  # of FMI 2.0 and of FMI 3.0
    "REAL": ("Real", "Float64"),
    "WHOLE": ("Integer", "UInt32"),
    "FLAG": ("Boolean", "Boolean"),
}


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU."""

    number: int
    name: str
    kind: str  # REAL, WHOLE or FLAG
    causality: str
    variability: str
    unit: str
    text: str
    start: str | None  # None: calculated


@dataclass(frozen=True)
class Unit:
    """What the description says of an FMU as a whole."""

    identifier: str  # of the library
    text: str
    token: str
    plant: bool
    step_s: float


def variables(
    parameters: Iterable[Parameter], values: Mapping[str, float], plant: bool
) -> list[Variable]:
    """Those of a unit; values: of the firmware's parameters at the start."""
    found = [
        _variable(*match.groups())
        for match in _ENTRY.finditer(LIST.read_text(encoding="utf-8"))
        if match[1] not in (("DRIVE_INPUT",) if plant else ("PLANT_INPUT", "TRUTH"))
    ]
    for index, entry in enumerate(parameters):
        variability = "tunable" if entry.access is Access.ANY_TIME else "fixed"
        found.append(
            Variable(
                PARAMETER_FIRST + index,
                f"parameter.{entry.name}",
                "REAL",
                "parameter",
                variability,
                "",
                f"{entry.text} [{entry.unit}]" if entry.unit else entry.text,
                repr(values[entry.name]),
            )
        )
    return found


def _variable(
    role: str, number: str, name: str, kind: str, start: str | None, unit: str, text: str
) -> Variable:
    place = {"OUTPUT": "", "TRUTH": "plant."}.get(role, "")
    given = role.endswith("INPUT")
    first = {"FLAG": "false", "WHOLE": "0", "REAL": start}[kind] if given else None
    causality = "input" if given else "output"
    return Variable(int(number), place + name, kind, causality, "discrete", unit, text, first)


def describe(version: int, unit: Unit, of_unit: list[Variable]) -> bytes:
    """The XML text, version 2 or 3."""
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion=f"{version}.0",
        modelName=unit.identifier,
        description=unit.text,
        generationTool=f"ZeroHertz {__version__}",
        variableNamingConvention="structured",
        **{"guid" if version == 2 else "instantiationToken": unit.token},
    )
    state = "FMUstate" if version == 2 else "FMUState"
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=unit.identifier,
        canHandleVariableCommunicationStepSize="true",
        **{f"canGetAndSet{state}": "true"},
        **{f"canSerialize{state}": "false" if unit.plant else "true"},
    )
    units = Xml.SubElement(root, "UnitDefinitions")
    for name in dict.fromkeys(variable.unit for variable in of_unit if variable.unit):
        Xml.SubElement(units, "Unit", name=name)
    Xml.SubElement(root, "DefaultExperiment", startTime="0", stepSize=repr(unit.step_s))
    (_as_version_2 if version == 2 else _as_version_3)(root, of_unit)
    Xml.indent(root)
    return Xml.tostring(root, encoding="UTF-8", xml_declaration=True)


def _as_version_2(root: Xml.Element, of_unit: list[Variable]) -> None:
    listed = Xml.SubElement(root, "ModelVariables")
    for variable in of_unit:
        scalar = Xml.SubElement(listed, "ScalarVariable", valueReference=str(variable.number))
        _fill(scalar, variable)
        value = Xml.SubElement(scalar, _TYPES[variable.kind][0])
        _value(value, variable)
    structure = Xml.SubElement(root, "ModelStructure")
    outputs = [str(k) for k, v in enumerate(of_unit, start=1) if v.causality == "output"]
    for list_name in ("Outputs", "InitialUnknowns"):
        unknowns = Xml.SubElement(structure, list_name)
        for index in outputs:
            Xml.SubElement(unknowns, "Unknown", index=index)


def _as_version_3(root: Xml.Element, of_unit: list[Variable]) -> None:
    listed = Xml.SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": "0", "causality": "independent"}
    Xml.SubElement(listed, "Float64", **time, variability="continuous")
    for variable in of_unit:
        element = Xml.SubElement(
            listed, _TYPES[variable.kind][1], valueReference=str(variable.number)
        )
        _fill(element, variable)
        _value(element, variable)
    structure = Xml.SubElement(root, "ModelStructure")
    outputs = [str(v.number) for v in of_unit if v.causality == "output"]
    for name in ("Output", "InitialUnknown"):
        for number in outputs:
            Xml.SubElement(structure, name, valueReference=number)


def _fill(element: Xml.Element, variable: Variable) -> None:
    element.set("name", variable.name)
    element.set("description", variable.text)
    element.set("causality", variable.causality)
    element.set("variability", variable.variability)


def _value(element: Xml.Element, variable: Variable) -> None:
    if variable.start is not None:
        assert variable.kind != "REAL" or math.isfinite(float(variable.start))
        element.set("start", variable.start)
    if variable.unit and variable.kind == "REAL":
        element.set("unit", variable.unit)
