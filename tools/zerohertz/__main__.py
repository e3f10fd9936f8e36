"""`python -m zerohertz` and the command `zh` of the installed package: what tools/zh runs."""

from __future__ import annotations

import sys


def main() -> None:
    """Run one command. `pip install zerohertz` alone brings numpy and no command line."""
    try:
        from zerohertz.cli import main as run
    except ModuleNotFoundError as error:
        if error.name not in ("typer", "rich", "plotext"):
            raise
        text = f"error: {error.name}: not installed; run pip install 'zerohertz[cli]'"
        print(text, file=sys.stderr)
        sys.exit(2)
    run()


if __name__ == "__main__":
    main()
