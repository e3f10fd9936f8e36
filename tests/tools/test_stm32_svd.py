"""Every address, offset and bit of hal/stm32f405 against ST's own description of the part (SVD)."""

from __future__ import annotations

import functools
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from cmsis_svd.parser import SVDParser

from zerohertz.paths import ROOT

PORT = ROOT / "hal" / "stm32f405"

# Type in stm32_registers.h and prefix of its macros -> peripherals of the SVD it stands for.
BLOCKS = {
    "rcc": ("RCC",),
    "flash": ("FLASH",),
    "pwr": ("PWR",),
    "gpio": ("GPIOA", "GPIOB", "GPIOC"),
    "tim": ("TIM1",),
    "adc": ("ADC1", "ADC2", "ADC3"),
    "adc_common": ("C_ADC",),
    "usart": ("USART3", "UART4"),
    "can": ("CAN1",),
    "iwdg": ("IWDG",),
    "rng": ("RNG",),
    "dbg": ("DBG",),
}
# These lack what only TIM1 has; the rest of the block is the same.
TIM_LACKS = {
    "TIM1": set(),
    "TIM5": {"RCR", "BDTR"},
    "TIM7": {"RCR", "BDTR", "SMCR", "CCMR1_Output", "CCMR2_Output", "CCER"}
    | {f"CCR{channel}" for channel in range(1, 5)},
}
# The common block of the ADCs shares the prefix ADC with them.
COMMON_REGISTERS = {"CCR"}
# Names that differ from the SVD's.
REGISTER_NAMES = {"CCMR1": "CCMR1_Output", "CCMR2": "CCMR2_Output", "APB2FZ": "DBGMCU_APB2_FZ"}
BASES = {"ADC_COMMON": "C_ADC"}
# Fields that ST left out of this part's file, and a part with the same block that has them.
GAPS = {"SMPR1": "STM32F20x.svd", "SMPR2": "STM32F20x.svd", "VOS_Pos": "STM32F401x.svd"}


@dataclass(frozen=True)
class Header:
    """What the port's headers say: struct members by block, macros, values as the compiler sees."""

    members: dict[str, list[str]]
    fields: list[str]
    bases: list[str]
    values: dict[str, int]


@pytest.fixture(scope="module")
def svd() -> dict[str, Any]:
    return peripherals("STM32F40x.svd")


@functools.cache
def peripherals(file: str) -> dict[str, Any]:
    device = SVDParser.for_packaged_svd("STMicro", file).get_device()
    return {peripheral.name: peripheral for peripheral in device.peripherals}


@pytest.fixture(scope="module")
def header(tmp_path_factory: pytest.TempPathFactory) -> Header:
    text = {name: (PORT / name).read_text() for name in ("stm32_registers.h", "stm32_map.h")}
    return read(text, tmp_path_factory.mktemp("svd"))


def read(text: dict[str, str], folder: Path) -> Header:
    """Parses names, compiles a program that prints offsets and values."""
    registers, addresses = text["stm32_registers.h"], text["stm32_map.h"]
    members = {}
    for body, block in re.findall(r"typedef struct \{(.*?)\} stm32_(\w+)_t;", registers, re.DOTALL):
        names = re.findall(r"\b([A-Za-z]\w*)\b(?:\[\d+\])?\s*[,;]", body)
        members[block] = [name for name in names if not name.startswith("reserved_")]
    fields = re.findall(r"#define ([A-Z0-9]+_[A-Z0-9]+_\w+) +[(\d]", registers)
    bases = re.findall(r"#define STM32_(\w+)_BASE\s", addresses)
    lines = [
        f'p("{block}.{name}", offsetof(stm32_{block}_t, {name}));'
        for block, names in members.items()
        for name in names
    ]
    lines += [f'p("{name}", {name});' for name in fields]
    lines += [f'p("{name}", STM32_{name}_BASE);' for name in bases]
    irqs = re.findall(r"#define STM32_(IRQ_\w+)\s", addresses)
    lines += [f'p("{name}", STM32_{name});' for name in irqs]
    for name, content in text.items():
        (folder / name).write_text(content)
    (folder / "dump.c").write_text(
        "#include <stddef.h>\n#include <stdio.h>\n"
        '#include "stm32_map.h"\n#include "stm32_registers.h"\n'
        'static void p(const char *n, unsigned long v) { printf("%s %lu\\n", n, v); }\n'
        "int main(void) {" + "\n".join(lines) + "}\n"
    )
    subprocess.run(("gcc", "dump.c", "-o", "dump"), cwd=folder, check=True)
    out = subprocess.run(("./dump",), cwd=folder, check=True, capture_output=True, text=True).stdout
    values = {name: int(value) for name, value in (line.split() for line in out.splitlines())}
    return Header(members, fields, bases, values)


def wrong_offsets(header: Header, svd: dict[str, Any]) -> list[str]:
    found = []
    for block, names in header.members.items():
        for peripheral in TIM_LACKS if block == "tim" else BLOCKS[block]:
            offsets = {r.name: r.address_offset for r in svd[peripheral].registers}
            for name in names:
                if name in TIM_LACKS.get(peripheral, set()):
                    continue
                if offsets.get(name) != header.values[f"{block}.{name}"]:
                    found.append(f"{peripheral}.{name}")
    return found


def wrong_fields(header: Header, svd: dict[str, Any]) -> list[str]:
    found = []
    for macro in header.fields:
        prefix, register, field = macro.split("_", 2)
        common = prefix == "ADC" and register in COMMON_REGISTERS
        for peripheral in BLOCKS["adc_common" if common else prefix.lower()]:
            other = GAPS.get(register) or GAPS.get(field)
            block = (peripherals(other) if other else svd)[peripheral]
            bits = bits_of(block, REGISTER_NAMES.get(register, register), field)
            if header.values[macro] != bits:
                found.append(f"{peripheral}.{macro}")
    return found


def bits_of(peripheral: Any, register: str, field: str) -> int | None:
    """A field's mask, or with _Pos its lowest bit. Some fields the SVD has bit by bit: SW0, SW1."""
    name = field.removesuffix("_Pos").removesuffix("_Msk")
    fields = next((r.fields for r in peripheral.registers if r.name == register), [])
    parts = [f for f in fields if f.name == name]
    parts = parts or [f for f in fields if re.fullmatch(rf"{name}\d", f.name)]
    if not parts:
        return None
    if field.endswith("_Pos"):
        return min(f.bit_offset for f in parts)
    return sum(((1 << f.bit_width) - 1) << f.bit_offset for f in parts)


def wrong_bases(header: Header, svd: dict[str, Any]) -> list[str]:
    return [n for n in header.bases if svd[BASES.get(n, n)].base_address != header.values[n]]


def test_every_register_lies_where_st_says(header: Header, svd: dict[str, Any]) -> None:
    assert set(header.members) == set(BLOCKS)
    assert sum(map(len, header.members.values())) >= 60
    assert wrong_offsets(header, svd) == []


def test_every_bit_is_what_st_says(header: Header, svd: dict[str, Any]) -> None:
    assert len(header.fields) > 90
    assert wrong_fields(header, svd) == []


def test_every_block_and_interrupt_is_where_st_says(header: Header, svd: dict[str, Any]) -> None:
    used = {name for names in BLOCKS.values() for name in names} | set(TIM_LACKS)
    assert {BASES.get(name, name) for name in header.bases} == used
    assert wrong_bases(header, svd) == []
    numbers = {i.name: i.value for p in svd.values() for i in p.interrupts or ()}
    for name, irq in {"ADC": "ADC", "CAN": "CAN1_RX0", "UART4": "UART4", "TIM7": "TIM7"}.items():
        assert header.values[f"IRQ_{name}"] == numbers[f"{irq}_IRQ"]


def test_option_bytes_are_out_of_reach(header: Header) -> None:
    """Neither their key nor their register has a name, and the block ends before the latter."""
    assert {"OPTKEYR", "OPTCR"}.isdisjoint(header.members["flash"])
    assert header.values["flash.CR"] == 0x10
    text = (PORT / "stm32_flash.c").read_text()
    assert "reserved_08" not in text
    assert "08192A3B" not in text.upper()


@pytest.mark.parametrize(
    ("file", "right", "wrong", "finds"),
    [
        ("stm32_registers.h", "reserved_14[9]", "reserved_14[8]", "ADC1.JSQR"),
        ("stm32_registers.h", "BDTR_MOE (1u << 15)", "BDTR_MOE (1u << 14)", "TIM1.TIM_BDTR_MOE"),
        ("stm32_registers.h", "PLLN_Pos 6u", "PLLN_Pos 7u", "RCC.RCC_PLLCFGR_PLLN_Pos"),
        ("stm32_map.h", "0x40012100u", "0x40012400u", "ADC2"),
    ],
)
def test_a_slip_is_found(
    svd: dict[str, Any], tmp_path: Path, file: str, right: str, wrong: str, finds: str
) -> None:
    """Negative control."""
    text = {}
    for name in ("stm32_registers.h", "stm32_map.h"):
        text[name] = re.sub(r"(?<=\w) +(?=[(\d])", " ", (PORT / name).read_text())
    assert right in text[file]
    text[file] = text[file].replace(right, wrong)
    header = read(text, tmp_path)
    assert finds in wrong_offsets(header, svd) + wrong_fields(header, svd) + wrong_bases(
        header, svd
    )
