"""Every address, offset, bit and reset value of hal/stm32g431 against the crate stm32g4.

The crate is made from ST's description of the part. cargo fetches it when the test runs; its
checksum is pinned here, and nothing of it is kept in the repository.
"""

from __future__ import annotations

import functools
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from zerohertz.paths import ROOT

PORT = ROOT / "hal" / "stm32g431"
VERSION = "0.16.0"
CHECKSUM = "97bc6434066d2459f0e0834ade8b03e5c5e8d4aad84dc2ff50e56464e6104f4d"
KEPT = ROOT / ".cache" / f"stm32g4-{VERSION}"

# Type in stm32_registers.h and prefix of its macros -> peripherals of the crate it stands for.
BLOCKS = {
    "rcc": ("RCC",),
    "flash": ("FLASH",),
    "pwr": ("PWR",),
    "gpio": ("GPIOA", "GPIOB", "GPIOC"),
    "tim": ("TIM1", "TIM2", "TIM7"),
    "adc": ("ADC1", "ADC2"),
    "adc_common": ("ADC12_COMMON",),
    "dac": ("DAC3",),
    "comp": ("COMP",),
    "opamp": ("OPAMP",),
    "syscfg": ("SYSCFG",),
    "usart": ("USART1", "USART2"),
    "fdcan": ("FDCAN1", "FDCAN"),
    "iwdg": ("IWDG",),
    "wwdg": ("WWDG",),
    "rng": ("RNG",),
    "dbg": ("DBGMCU",),
}
# These lack what only TIM1 has; the rest of the block is the same.
LACKS = {
    "TIM2": {"RCR", "BDTR"},
    "TIM7": {"RCR", "BDTR", "SMCR", "CCMR1_Output", "CCMR2_Output", "CCER", "AF1"}
    | {f"CCR{channel}" for channel in range(1, 5)},
}
# Names that differ from the crate's.
REGISTERS = {"CCMR1": "CCMR1_Output", "CCMR2": "CCMR2_Output", "APB2FZ": "APB2_FZ"}
# The crate takes the message memory for another controller.
BASES = {"ADC_COMMON": "ADC12_COMMON", "DBG": "DBGMCU", "CAN_RAM": "FDCAN"}


@dataclass(frozen=True)
class Header:
    """What the port's headers say: struct members by block, macros, values as the compiler sees."""

    members: dict[str, list[str]]
    fields: list[str]
    resets: list[str]
    bases: list[str]
    values: dict[str, int]


@pytest.fixture(scope="module")
def crate() -> Path:
    """Folder with the sources of the part."""
    folder = KEPT / "stm32g4" / "src" / "stm32g431"
    if not folder.is_dir():
        fetch()
    return folder


def fetch() -> None:
    """With cargo, which compares what it gets with the checksum of the registry; ours is pinned."""
    if shutil.which("cargo") is None:
        pytest.skip("cargo is not installed: apt-get install cargo")
    work = KEPT.with_name(f"{KEPT.name}.part")
    shutil.rmtree(work, ignore_errors=True)
    (work / "src").mkdir(parents=True)
    (work / "src" / "lib.rs").touch()
    (work / "Cargo.toml").write_text(
        '[package]\nname = "probe"\nversion = "0.0.0"\nedition = "2021"\n'
        f'[dependencies]\nstm32g4 = "={VERSION}"\n[workspace]\n'
    )
    subprocess.run(
        ("cargo", "vendor", "--quiet", "vendor"), cwd=work, check=True, capture_output=True
    )
    lock = (work / "Cargo.lock").read_text()
    entry = re.search(r'name = "stm32g4"\n(?:.*\n)*?checksum = "(\w+)"', lock)
    assert entry is not None
    assert entry[1] == CHECKSUM
    shutil.rmtree(KEPT, ignore_errors=True)
    (work / "vendor").rename(KEPT)
    shutil.rmtree(work)


@pytest.fixture(scope="module")
def header(tmp_path_factory: pytest.TempPathFactory) -> Header:
    text = {name: (PORT / name).read_text() for name in ("stm32_registers.h", "stm32_map.h")}
    return read(text, tmp_path_factory.mktemp("crate"))


def read(text: dict[str, str], folder: Path) -> Header:
    """Parses names, compiles a program that prints offsets and values."""
    registers, addresses = text["stm32_registers.h"], text["stm32_map.h"]
    members = {}
    for body, block in re.findall(r"typedef struct \{(.*?)\} stm32_(\w+)_t;", registers, re.DOTALL):
        names = re.findall(r"\b([A-Za-z]\w*)\b(?:\[\d+\])?\s*[,;]", body)
        members[block] = [name for name in names if not name.startswith("reserved_")]
    defined = re.findall(r"#define ([A-Z0-9]+_[A-Z0-9]+_\w+) +[(\d]", registers)
    resets = [name for name in defined if name.endswith("_RESET")]
    fields = [name for name in defined if name not in resets]
    bases = re.findall(r"#define STM32_(\w+)_BASE\s", addresses)
    irqs = re.findall(r"#define STM32_(IRQ_\w+)\s", addresses)
    lines = [
        f'p("{block}.{name}", offsetof(stm32_{block}_t, {name}));'
        for block, names in members.items()
        for name in names
    ]
    lines += [f'p("{name}", {name});' for name in defined]
    lines += [f'p("{name}", STM32_{name}_BASE);' for name in bases]
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
    return Header(members, fields, resets, bases, values)


@functools.cache
def modules(crate: Path) -> dict[str, tuple[str, int]]:
    """Peripheral -> name of its module, base address."""
    text = (crate / "mod.rs").read_text()
    found = re.findall(r"pub type (\w+) = crate::Periph<(\w+)::RegisterBlock, (0x[\da-f_]+)>", text)
    return {name: (module, int(base.replace("_", ""), 16)) for name, module, base in found}


@functools.cache
def offsets(crate: Path, module: str) -> dict[str, tuple[int, str]]:
    """Register -> offset, name of its type, as the accessors say."""
    text = (crate / f"{module}.rs").read_text()
    pattern = (
        r"///0x([\da-f]+)(?:\.\.0x[\da-f]+)? - [^\n]*\n(?:\s*(?:///|#\[)[^\n]*\n)*"
        r"\s*pub const fn (\w+)\(&self\) -> &(\w+)"
    )
    return {
        name.upper(): (int(offset, 16), kind) for offset, name, kind in re.findall(pattern, text)
    }


@functools.cache
def fields_of(crate: Path, module: str, kind: str) -> dict[str, int]:
    """Field -> mask, from the readers; of what is only written, from the writers."""
    text = (crate / module / f"{kind.lower()}.rs").read_text()
    found = {}
    for name, at in re.findall(r"pub fn (\w+)\(&mut self\)[^{]*\{\s*\w+::new\(self, (\d+)\)", text):
        found[name.upper()] = 1 << int(at)
    pattern = (
        r"pub fn (\w+)\(&self\) -> \w+ \{\s*\w+::new\(\(?\(?self\.bits(?: >> (\d+)\))?"
        r" & (0x[\da-f_]+|\d+)\)"
    )
    for name, at, mask in re.findall(pattern, text):
        found[name.upper()] = int(mask.replace("_", ""), 0) << int(at or 0)
    return found


def reset_of(crate: Path, module: str, kind: str) -> int:
    text = (crate / module / f"{kind.lower()}.rs").read_text()
    value = re.search(r"RESET_VALUE: u\d+ = (0x[\da-f_]+|\d+)", text)
    assert "crate::Resettable for" in text
    return int(value[1].replace("_", ""), 0) if value else 0


def wrong_offsets(header: Header, crate: Path) -> list[str]:
    found = []
    for block, names in header.members.items():
        for peripheral in BLOCKS[block]:
            known = offsets(crate, modules(crate)[peripheral][0])
            for name in set(names) - LACKS.get(peripheral, set()):
                if known.get(name.upper(), (None,))[0] != header.values[f"{block}.{name}"]:
                    found.append(f"{peripheral}.{name}")
    return found


def wrong_fields(header: Header, crate: Path) -> list[str]:
    found = []
    for macro in header.fields:
        block, register, field = parts(macro)
        peripheral = BLOCKS[block][0]
        module = modules(crate)[peripheral][0]
        _, kind = offsets(crate, module).get(register.upper(), (0, register))
        mask = fields_of(crate, module, kind).get(field.removesuffix("_Pos").removesuffix("_Msk"))
        if mask is not None and field.endswith("_Pos"):
            mask = (mask & -mask).bit_length() - 1
        if header.values[macro] != mask:
            found.append(f"{peripheral}.{macro}")
    return found


def parts(macro: str) -> tuple[str, str, str]:
    """Block, register and field of a macro: OPAMP_OPAMP1_CSR_OPAEN has a register of two words."""
    prefix, register, field = macro.split("_", 2)
    if prefix == "OPAMP":
        second, field = field.split("_", 1)
        register = f"{register}_{second}"
    block = "adc_common" if (prefix, register) == ("ADC", "CCR") else prefix.lower()
    return block, REGISTERS.get(register, register), field


def wrong_resets(header: Header, crate: Path) -> list[str]:
    found = []
    for macro in header.resets:
        prefix, register = macro.removesuffix("_RESET").split("_")
        peripheral = prefix if prefix in modules(crate) else BLOCKS[prefix.lower()][0]
        module = modules(crate)[peripheral][0]
        if reset_of(crate, module, offsets(crate, module)[register][1]) != header.values[macro]:
            found.append(macro)
    return found


def wrong_bases(header: Header, crate: Path) -> list[str]:
    known = modules(crate)
    return [n for n in header.bases if known[BASES.get(n, n)][1] != header.values[n]]


def wrong_interrupts(header: Header, crate: Path) -> list[str]:
    text = (crate / "mod.rs").read_text()
    known = {"IRQ_ADC": "ADC1_2", "IRQ_TIM7": "TIM7", "IRQ_CAN": "FDCAN1_IT0"}
    known |= {f"IRQ_{name}": name for name in ("USART1", "USART2")}
    return [
        name
        for name, interrupt in known.items()
        if f"\n    {interrupt} = {header.values[name]}," not in text
    ]


def test_every_register_lies_where_the_crate_says(header: Header, crate: Path) -> None:
    assert set(header.members) == set(BLOCKS)
    assert sum(map(len, header.members.values())) >= 80
    assert wrong_offsets(header, crate) == []


def test_every_bit_is_what_the_crate_says(header: Header, crate: Path) -> None:
    assert len(header.fields) > 120
    assert wrong_fields(header, crate) == []


def test_every_reset_value_is_what_the_crate_says(header: Header, crate: Path) -> None:
    assert len(header.resets) >= 10
    assert wrong_resets(header, crate) == []


def test_every_block_and_interrupt_is_where_the_crate_says(header: Header, crate: Path) -> None:
    used = {name for names in BLOCKS.values() for name in names}
    assert {BASES.get(name, name) for name in header.bases} == used
    assert wrong_bases(header, crate) == []
    assert wrong_interrupts(header, crate) == []


def test_option_bytes_are_out_of_reach(header: Header) -> None:
    """Neither their key nor their register has a name, and the block ends before the latter."""
    assert {"OPTKEYR", "OPTR"}.isdisjoint(header.members["flash"])
    assert header.values["flash.CR"] == 0x14
    text = (PORT / "g431_flash.c").read_text()
    assert "reserved_0C" not in text
    assert "08192A3B" not in text.upper()


@pytest.mark.parametrize(
    ("file", "right", "wrong", "finds"),
    [
        ("stm32_registers.h", "reserved_1C[12]", "reserved_1C[11]", "ADC1.JSQR"),
        ("stm32_registers.h", "BDTR_MOE (1u << 15)", "BDTR_MOE (1u << 14)", "TIM1.TIM_BDTR_MOE"),
        ("stm32_registers.h", "PLLN_Pos 8u", "PLLN_Pos 6u", "RCC.RCC_PLLCFGR_PLLN_Pos"),
        ("stm32_registers.h", "CR5_RESET 0x00000100u", "CR5_RESET 0x0u", "PWR_CR5_RESET"),
        ("stm32_map.h", "0x50000100u", "0x50000400u", "ADC2"),
        ("stm32_map.h", "TIM7 55u", "TIM7 54u", "IRQ_TIM7"),
    ],
)
def test_a_slip_is_found(
    crate: Path, tmp_path: Path, file: str, right: str, wrong: str, finds: str
) -> None:
    """Negative control."""
    text = {}
    for name in ("stm32_registers.h", "stm32_map.h"):
        text[name] = re.sub(r"(?<=\w) +(?=[(\d])", " ", (PORT / name).read_text())
    assert right in text[file]
    text[file] = text[file].replace(right, wrong)
    header = read(text, tmp_path)
    checks = (wrong_offsets, wrong_fields, wrong_resets, wrong_bases, wrong_interrupts)
    assert finds in [found for check in checks for found in check(header, crate)]
