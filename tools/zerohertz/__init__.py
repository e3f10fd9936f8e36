"""Tools of the ZeroHertz drive: gain design, certificates, simulation, reports, tests.

`Drive` runs the firmware from Python, one control period per call; `Plant` is the simulated rig
beside it. `zerohertz.sim.run` runs both from files. `zerohertz.estimator.Estimator` runs an
estimator alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from zerohertz.drive import Drive
    from zerohertz.plant import Plant

__all__ = ["Drive", "Plant"]
__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """Load them when they are asked for: a build uses this package without numpy."""
    if name == "Drive":
        from zerohertz.drive import Drive

        return Drive
    if name == "Plant":
        from zerohertz.plant import Plant

        return Plant
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
