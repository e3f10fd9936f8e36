"""The comparison of builds notices one bit."""

from __future__ import annotations

import numpy as np

from zerohertz.testing.bits import first_difference


def test_one_flipped_bit_is_named_with_signal_and_period(tmp_path):
    signal = np.linspace(0.0, 1.0, 50, dtype=np.float32)
    flipped = signal.copy()
    flipped.view(np.uint32)[17] ^= 1
    np.savez(tmp_path / "a.npz", t_s=signal, duty_u=signal)
    np.savez(tmp_path / "b.npz", t_s=signal, duty_u=flipped)
    assert first_difference(tmp_path / "a.npz", tmp_path / "a.npz") is None
    said = first_difference(tmp_path / "a.npz", tmp_path / "b.npz")
    assert said == "duty_u: 1 periods differ, the first is 17"


def test_a_shorter_run_is_a_difference(tmp_path):
    np.savez(tmp_path / "a.npz", t_s=np.zeros(5, dtype=np.float32))
    np.savez(tmp_path / "b.npz", t_s=np.zeros(4, dtype=np.float32))
    assert first_difference(tmp_path / "a.npz", tmp_path / "b.npz") == "t_s: 5 and 4 periods"
