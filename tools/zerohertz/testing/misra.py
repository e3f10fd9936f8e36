"""The list of MISRA C:2012 rules that the firmware departs from, each with its reason."""

from __future__ import annotations

import re
from pathlib import Path

from zerohertz.errors import UserError

_LINE = re.compile(r"(?P<rule>\d+\.\d+)(?: +(?P<file>[\w/]+\.(?:[ch]|def)))? +(?P<reason>\S.{9,})")


_NOTICE = re.compile(r"^\S+:\d+:\d+: \w+: .*\[[\w.-]+\]$", re.MULTILINE)


def notices(log: str) -> list[str]:
    """What cppcheck lists. Its exit code is not enough: 2.10 ends with 0 when only a rule over all
    files (5.6 to 5.9, 2.4, 8.5 ...) is broken."""
    return _NOTICE.findall(log)


def cppcheck_suppressions(path: Path) -> list[str]:
    """One cppcheck option per line `RULE [FILE] REASON`; a rule without a reason is refused."""
    options = []
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        match = _LINE.fullmatch(line.rstrip())
        if not match:
            raise UserError(f"{path.name}: line {number}: not 'RULE [FILE] REASON'; mend the line")
        where = f":*{match['file']}" if match["file"] else ""
        options.append(f"--suppress=misra-c2012-{match['rule']}{where}")
    return options
