"""Example of an estimator in Python: the voltage model whose flux length a feedback holds.

tools/zh atlas --map i --estimator tools/zerohertz/estimators/flux_length.py:FluxLength
"""

from zerohertz.estimators.bridge import Estimate, Sample

FILTER_S, GAIN_PER_S = 0.004, 20.0


class FluxLength:
    """kr lambda' = u - Rs i - sigma Ls i' + kr g (M id* - |lambda|) lambda/|lambda|"""

    flux, omega, before = 0j, 0.0, 0j

    def init(self, params, motor):
        self.m, self.T, self.ref = motor, params.period_s, motor.M_H * params.i_d_A

    def seed(self, i_s_A, lambda_r_Wb, omega_e_rad_s):
        self.before, self.flux, self.omega = i_s_A, lambda_r_Wb, omega_e_rad_s

    def step(self, x: Sample) -> Estimate:
        m, i, size = self.m, x.i_s_A, max(abs(self.flux), 0.05 * self.ref)
        leak = m.sigma_Ls_H * (i - self.before)
        turn = (self.T * (x.u_s_V - m.Rs_ohm * (i + self.before) / 2) - leak) / m.kr
        omega_s = (self.flux.conjugate() * turn).imag / (size**2 * self.T)
        self.flux = self.flux * (1 + self.T * GAIN_PER_S * (self.ref / size - 1)) + turn
        slip = m.M_H * m.tau_per_s * (self.flux.conjugate() * i).imag / size**2
        self.omega += self.T / (self.T + FILTER_S) * (omega_s - slip - self.omega)
        self.before = i
        omega_frame = x.omega_frame_rad_s if x.frame_imposed else self.omega + slip
        return Estimate(self.flux, self.omega, omega_frame)

    def hold(self, x: Sample, omega_e_rad_s: float) -> Estimate:
        tau, self.before, self.omega = self.m.tau_per_s, x.i_s_A, omega_e_rad_s
        rate = self.m.M_H * tau * x.i_s_A - (tau - 1j * omega_e_rad_s) * self.flux
        self.flux += self.T * rate
        return Estimate(self.flux, omega_e_rad_s, omega_e_rad_s)
