"""Which stages are run. Standard library only: the launcher asks before it sets anything up."""

from __future__ import annotations

import argparse
import sys

from zerohertz.errors import UserError
from zerohertz.testing.stage import Stage
from zerohertz.testing.stages import all_stages


def select(stages: list[Stage], quick: bool, only: str) -> list[Stage]:
    """The stages named in `only` and what they need, else the quick ones, else all but those that
    have to be asked for."""
    if not only:
        return [stage for stage in stages if stage.quick or not (quick or stage.asked)]
    by_name = {stage.name: stage for stage in stages}
    wanted: set[str] = set()
    todo = [name.strip() for name in only.split(",")]
    while todo:
        name = todo.pop()
        if name not in by_name:
            raise UserError(f"--only: no stage '{name}'; there are {', '.join(by_name)}")
        wanted.add(name)
        todo += by_name[name].needs
    return [stage for stage in stages if stage.name in wanted]


def main() -> None:
    """Of the words of `zh test`, --only alone: exit 2 when it names a stage that is none."""
    words = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    words.add_argument("--only", nargs="?", default="")
    try:
        select(all_stages(), False, words.parse_known_args()[0].only or "")
    except UserError as error:
        sys.exit(f"error: {error}")  # says so on stderr


if __name__ == "__main__":
    main()
