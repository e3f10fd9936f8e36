"""Estimators of others in the drive: a folder in C (firmware/law/estimator/estimator.h), or a class
in Python."""

from __future__ import annotations

from zerohertz.estimators.bridge import Estimate, PythonEstimator, Sample, use

__all__ = ["Estimate", "PythonEstimator", "Sample", "use"]
