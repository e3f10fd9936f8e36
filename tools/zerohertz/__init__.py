"""Tools of the ZeroHertz drive: gain design, certificates, simulation, reports, tests."""

from __future__ import annotations

__version__ = "0.1.0"
