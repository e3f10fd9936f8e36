"""Tools of the ZeroHertz drive: gain design, certificates, simulation, reports, tests.

`Drive` runs the firmware from Python, one control period per call. `zerohertz.sim.run` runs it on
the simulated rig. `zerohertz.estimator.Estimator` runs an estimator alone.
"""

from __future__ import annotations

from zerohertz.drive import Drive

__all__ = ["Drive"]
__version__ = "0.1.0"
