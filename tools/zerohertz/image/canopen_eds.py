"""tools/docs/zerohertz.eds: object dictionary of the CANopen slave, from the firmware's lists."""

from __future__ import annotations

import re
from dataclasses import dataclass

from zerohertz.image.fieldbus_list import grouped, signals, writable
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "zerohertz.eds"
OBJECTS = ROOT / "firmware" / "fieldbus" / "canopen_objects.def"
PARAMETERS, SIGNALS = 0x2000, 0x3000  # canopen_od.h
_ROW = re.compile(
    r'^CANOPEN_(STORED|NODE|LIVE)\((\w+), (\d+), (\w+), (\w+), (\w+), "([^"]*)"\)', re.MULTILINE
)
_TYPES = {"I8": 2, "I16": 3, "U8": 5, "U16": 6, "U32": 7, "F32": 8, "TEXT": 9}
_ACCESS = {"RO": ("ro", 0), "RW": ("rw", 0), "TX": ("ro", 1), "RX": ("rww", 1)}
_NAMES = {
    0x1016: "Consumer heartbeat",
    0x1018: "Identity",
    0x1200: "SDO server",
    0x1400: "RPDO 1 communication",
    0x1401: "RPDO 2 communication",
    0x1600: "RPDO 1 mapping",
    0x1601: "RPDO 2 mapping",
    0x1800: "TPDO 1 communication",
    0x1801: "TPDO 2 communication",
    0x1A00: "TPDO 1 mapping",
    0x1A01: "TPDO 2 mapping",
}
_MANDATORY = (0x1000, 0x1001, 0x1018)
_HEAD = """\
; Generated from the lists of the firmware by `tools/zh params --page`: do not edit.
[FileInfo]
FileName=zerohertz.eds
FileVersion=1
FileRevision=1
EDSVersion=4.0
Description=ZeroHertz induction-motor drive

[DeviceInfo]
VendorName=ZeroHertz
VendorNumber=0
ProductName=ZeroHertz
ProductNumber=0
RevisionNumber=0
BaudRate_10=0
BaudRate_20=0
BaudRate_50=0
BaudRate_125=1
BaudRate_250=1
BaudRate_500=1
BaudRate_800=0
BaudRate_1000=1
SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=8
DynamicChannelsSupported=0
GroupMessaging=0
NrOfRXPDO=2
NrOfTXPDO=2
LSS_Supported=0
"""


@dataclass(frozen=True)
class Object:
    """One value of the dictionary."""

    index: int
    sub: int
    kind: str
    access: str
    default: str
    name: str


def objects() -> list[Object]:
    """All, in rising order."""
    found = [Object(0x1008, 0, "TEXT", "RO", "", "Manufacturer device name")]
    rows = _ROW.findall(OBJECTS.read_text(encoding="utf-8"))
    for how, index, sub, kind, access, value, name in rows:
        default = {"STORED": value, "NODE": f"$NODEID+{value}", "LIVE": ""}[how]
        found.append(Object(int(index, 16), int(sub), kind, access, default, name))
    for group, k, entry in grouped():
        kind = "U32" if entry.whole else "F32"
        access = "RW" if entry.name in writable() else "RO"
        found.append(Object(PARAMETERS + group, k + 1, kind, access, "", entry.name))
    for n, signal in enumerate(signals()):
        kind = "F32" if signal.is_float else "U32"
        found.append(Object(SIGNALS + n, 0, kind, "TX", "", signal.name))
    return sorted(found, key=lambda o: (o.index, o.sub))


def page_text() -> str:
    """The whole file."""
    listed = objects()
    indices = sorted({o.index for o in listed})
    optional = [k for k in indices if k not in _MANDATORY and not 0x2000 <= k < 0x6000]
    own = [k for k in indices if 0x2000 <= k < 0x6000]
    parts = [
        _HEAD,
        _list("MandatoryObjects", [k for k in indices if k in _MANDATORY]),
        _list("OptionalObjects", optional),
        _list("ManufacturerObjects", own),
    ]
    parts += [_object(k, [o for o in listed if o.index == k]) for k in indices]
    return "\n".join(parts)


def _object(index: int, subs: list[Object]) -> str:
    """Its section, and one for each sub-index of a record."""
    if len(subs) == 1 and subs[0].sub == 0:
        return f"[{index:04X}]\n{_value(subs[0])}"
    title = _NAMES.get(index, f"Parameters {index - PARAMETERS}")
    head = f"[{index:04X}]\nParameterName={title}\nObjectType=0x9\nSubNumber={len(subs)}\n"
    return "\n".join([head, *(f"[{index:04X}sub{o.sub:X}]\n{_value(o)}" for o in subs)])


def _list(title: str, indices: list[int]) -> str:
    rows = "\n".join(f"{k}=0x{index:04X}" for k, index in enumerate(indices, start=1))
    return f"[{title}]\nSupportedObjects={len(indices)}\n{rows}\n"


def _value(o: Object) -> str:
    access, mapped = _ACCESS[o.access]
    return (
        f"ParameterName={o.name}\nObjectType=0x7\nDataType=0x{_TYPES[o.kind]:04X}\n"
        f"AccessType={access}\nDefaultValue={o.default}\nPDOMapping={mapped}\n"
    )


def stale() -> bool:
    """Whether the committed file is not that of the lists."""
    return not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page_text()


def write() -> None:
    """The file where it belongs."""
    PAGE.write_text(page_text(), encoding="utf-8")
