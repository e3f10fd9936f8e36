"""`python -m zerohertz`: what tools/zh runs."""

from zerohertz.cli import main

main()
