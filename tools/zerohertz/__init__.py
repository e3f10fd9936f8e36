"""Tools of the ZeroHertz drive: gain design, certificates, simulation, reports, tests."""

from __future__ import annotations

from zerohertz.drive import Drive

__all__ = ["Drive"]
__version__ = "0.1.0"
