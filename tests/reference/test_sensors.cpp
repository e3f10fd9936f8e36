// Sensors: the ADC's end points, the voltage filter against its closed form, the statistics of
// noise.
#include "check.hpp"
#include "sensors.hpp"

#include <algorithm>
#include <complex>
#include <numbers>

using zh::Board;
using zh::FilterTransition;
using zh::LineVoltageFilter;
using zh::NoiseSource;
using zh::SensorParameters;
using zh::Sensors;
using zh::Words;

namespace {

constexpr double wc = 2.0 * std::numbers::pi * 800.0;

Words sampled(Sensors &sensors, const zh::Phases &i_A, double u_uv_V, double u_vw_V, double u_dc_V,
              int bits = 14)
{
    return zh::clipped(sensors.sample(i_A, u_uv_V, u_vw_V, u_dc_V), (1 << bits) - 1);
}

// i = (code - 2^(n-1)) I_fs / 2^(n-1); u_dc = code U_fs / 2^n.
void codes_are_those_of_the_board_formula()
{
    const Board paper;
    Sensors sensors({}, paper, 1);
    const Words zero = sampled(sensors, {0.0, 0.0, 0.0}, 0.0, 0.0, 0.0);
    CHECK(zero.i_u == 8192 && zero.i_v == 8192 && zero.i_w == 8192);
    CHECK(zero.u_uv == 8192 && zero.u_vw == 8192 && zero.u_dc == 0);
    const Words some = sampled(sensors, {12.5, -12.5, 25.0 / 8192}, 200.0, -100.0, 283.0);
    CHECK(some.i_u == 8192 + 4096 && some.i_v == 8192 - 4096 && some.i_w == 8193);
    CHECK(some.u_uv == 8192 + 4096 && some.u_vw == 8192 - 2048);
    CHECK(some.u_dc == 11592); // 283/400 * 16384 = 11591.68
    const Words ends = sampled(sensors, {25.0, -25.0, 24.997}, 400.0, -400.0, 400.0);
    CHECK(ends.i_u == 16383 && ends.i_v == 0 && ends.i_w == 16383);
    CHECK(ends.u_uv == 16383 && ends.u_vw == 0 && ends.u_dc == 16383);
    const Words beyond = sampled(sensors, {1e9, -1e9, std::nan("")}, INFINITY, -INFINITY, -5.0);
    CHECK(beyond.i_u == 16383 && beyond.i_v == 0 && beyond.i_w == 0);
    CHECK(beyond.u_uv == 16383 && beyond.u_vw == 0 && beyond.u_dc == 0);
}

void codes_round_to_the_nearest()
{
    Sensors sensors({}, Board{}, 1);
    constexpr double lsb = 25.0 / 8192;
    CHECK(sampled(sensors, {0.49 * lsb, 0.51 * lsb, -0.49 * lsb}, 0, 0, 0).i_u == 8192);
    CHECK(sampled(sensors, {0.49 * lsb, 0.51 * lsb, -0.49 * lsb}, 0, 0, 0).i_v == 8193);
    CHECK(sampled(sensors, {0.49 * lsb, -0.51 * lsb, -0.49 * lsb}, 0, 0, 0).i_w == 8192);
    CHECK(sampled(sensors, {0.49 * lsb, -0.51 * lsb, -0.49 * lsb}, 0, 0, 0).i_v == 8191);
}

void another_board_scales_otherwise()
{
    Board board;
    board.adc_bits = 12;
    board.current_full_scale_A = 50.0;
    board.dc_link_full_scale_V = 800.0;
    Sensors sensors({}, board, 1);
    const Words w = sampled(sensors, {25.0, -50.0, 50.0}, 0.0, 0.0, 400.0, 12);
    CHECK(w.i_u == 3072 && w.i_v == 0 && w.i_w == 4095 && w.u_uv == 2048 && w.u_dc == 2048);
}

void gain_and_offset_act_per_channel()
{
    SensorParameters p;
    p.current_offset_A = {1.0, -2.0, 0.0};
    p.current_gain = {1.1, 1.0, 0.5};
    p.voltage_offset_V = {-10.0, 20.0};
    p.voltage_gain = {0.9, 1.2};
    p.dc_gain = 1.01;
    p.dc_offset_V = -3.0;
    Sensors sensors(p, Board{}, 1);
    const Words w = sampled(sensors, {10.0, 5.0, -8.0}, 100.0, -50.0, 300.0);
    const auto amps = [](int code) { return (code - 8192) * 25.0 / 8192; };
    const auto volts = [](int code) { return (code - 8192) * 400.0 / 8192; };
    CHECK_NEAR(amps(w.i_u), 12.0, 0.0016);
    CHECK_NEAR(amps(w.i_v), 3.0, 0.0016);
    CHECK_NEAR(amps(w.i_w), -4.0, 0.0016);
    CHECK_NEAR(volts(w.u_uv), 80.0, 0.0245);
    CHECK_NEAR(volts(w.u_vw), -40.0, 0.0245);
    CHECK_NEAR(w.u_dc * 400.0 / 16384, 300.0, 0.0123);
}

// Step response of wc^2/(s^2 + 2 D wc s + wc^2) from its poles, real or complex.
double step_response(double damping, double t_s)
{
    const std::complex<double> root = std::sqrt(std::complex<double>(damping * damping - 1.0));
    const std::complex<double> s1 = wc * (-damping + root);
    const std::complex<double> s2 = wc * (-damping - root);
    return (1.0 + (s2 * std::exp(s1 * t_s) - s1 * std::exp(s2 * t_s)) / (s1 - s2)).real();
}

void the_step_response_is_exact_however_time_is_cut()
{
    for (const double damping : {0.70710678118654752, 0.3, 1.5, 5.0}) {
        for (const double h_s : {0.7e-6, 3e-6, 50e-6, 100e-6, 1e-3}) {
            LineVoltageFilter filter(800.0, damping);
            const auto transition = filter.transition(h_s);
            const int steps = static_cast<int>(1.2e-3 / h_s) + 1;
            for (int k = 1; k <= steps; ++k) {
                filter.advance(transition, 100.0, -30.0);
                if (k % 7 == 1 || k == steps) {
                    const double truth = step_response(damping, k * h_s);
                    CHECK_NEAR(filter.u_uv_V(), 100.0 * truth, 1e-8);
                    CHECK_NEAR(filter.u_vw_V(), -30.0 * truth, 1e-8);
                }
            }
        }
    }
}

// exp(A wc h) by the eigenvalues of A.
FilterTransition analytic(double damping, double wc_h)
{
    const std::complex<double> root = std::sqrt(std::complex<double>(damping * damping - 1.0));
    const std::complex<double> s1 = -damping + root;
    const std::complex<double> s2 = -damping - root;
    const std::complex<double> e1 = std::exp(s1 * wc_h);
    const std::complex<double> e2 = std::exp(s2 * wc_h);
    const double q = ((e1 - e2) / (s1 - s2)).real();
    const double p = ((s1 * e2 - s2 * e1) / (s1 - s2)).real();
    return {p, q, p - 2.0 * damping * q};
}

void the_series_of_a_period_is_the_transition()
{
    struct Case {
        double cutoff_Hz, damping, period_s;
        bool fits;
    };
    constexpr double butterworth = 0.70710678118654752;
    for (const Case &c :
         {Case{800.0, butterworth, 200e-6, true}, Case{800.0, butterworth, 100e-6, true},
          Case{400.0, 3.0, 200e-6, true}, Case{1600.0, 0.1, 125e-6, true},
          Case{8000.0, butterworth, 200e-6, false}}) {
        const LineVoltageFilter filter(c.cutoff_Hz, c.damping, c.period_s);
        CHECK(filter.series_fits() == c.fits);
        for (double share = 0.0; share <= 1.0; share += 0.01) {
            const double h_s = share * c.period_s;
            const auto truth = analytic(c.damping, 2.0 * std::numbers::pi * c.cutoff_Hz * h_s);
            const auto e = filter.part_of_period(h_s);
            CHECK_NEAR(e.p, truth.p, 1e-12);
            CHECK_NEAR(e.q, truth.q, 1e-12);
            CHECK_NEAR(e.r, truth.r, 1e-12);
        }
    }
}

void the_frequency_response_is_that_of_butterworth()
{
    for (const double f_Hz : {10.0, 57.0, 400.0, 800.0, 3000.0}) {
        LineVoltageFilter filter(800.0, 0.70710678118654752);
        constexpr int period = 1000; // steps; the held input misses (pi/1000)^2/6 of its amplitude
        const double h_s = 1.0 / (f_Hz * period);
        const auto transition = filter.transition(h_s);
        const double omega = 2.0 * std::numbers::pi * f_Hz;
        std::complex<double> sum = 0.0;
        const int settle = period * (1 + static_cast<int>(f_Hz * 5e-3));
        for (int k = 0; k < settle + period; ++k) {
            filter.advance(transition, std::cos(omega * (k + 0.5) * h_s), 0.0);
            if (k >= settle) {
                sum += filter.u_uv_V() * std::polar(2.0 / period, -omega * (k + 1.0) * h_s);
            }
        }
        const std::complex<double> s(0.0, f_Hz / 800.0);
        const auto truth = 1.0 / (s * s + std::numbers::sqrt2 * s + 1.0);
        CHECK_NEAR(std::abs(sum - truth), 0.0, 1e-5 * std::abs(truth));
    }
    const std::complex<double> s(0.0, 57.0 / 800.0); // "5.7 deg at 57 Hz" (THEORY 6)
    CHECK_NEAR(-std::arg(1.0 / (s * s + std::numbers::sqrt2 * s + 1.0)) * 180.0 / std::numbers::pi,
               5.8, 0.1);
}

void noise_is_the_same_everywhere()
{
    // From a separate program: splitmix64 from seed 0 and 42, then xoshiro256++.
    NoiseSource zero(0);
    CHECK(zero.bits() == 0x53175d61490b23dfU);
    CHECK(zero.bits() == 0x61da6f3dc380d507U);
    NoiseSource other(42);
    CHECK(other.bits() == 0xd0764d4f4476689fU);
}

void noise_has_the_statistics_it_promises()
{
    NoiseSource source(7);
    constexpr int count = 1000000;
    double sum = 0.0, sum2 = 0.0, sum3 = 0.0, sum4 = 0.0, lagged = 0.0, last = 0.0, peak = 0.0;
    int beyond_2 = 0;
    for (int k = 0; k < count; ++k) {
        const double x = source.gaussian();
        sum += x;
        sum2 += x * x;
        sum3 += x * x * x;
        sum4 += x * x * x * x;
        lagged += x * last;
        last = x;
        beyond_2 += std::abs(x) > 2.0;
        peak = std::max(peak, std::abs(x));
    }
    // Five standard errors of each estimate.
    CHECK_NEAR(sum / count, 0.0, 5e-3);
    CHECK_NEAR(sum2 / count, 1.0, 7e-3);
    CHECK_NEAR(sum3 / count, 0.0, 2e-2);
    CHECK_NEAR(sum4 / count, 2.85, 5e-2);
    CHECK_NEAR(lagged / count, 0.0, 5e-3);
    CHECK_NEAR(static_cast<double>(beyond_2) / count, 0.0455, 2e-3);
    CHECK(peak > 4.0 && peak < 4.9);
}

void channels_carry_their_own_noise()
{
    SensorParameters p;
    p.current_noise_A = 0.05;
    p.voltage_noise_V = 1.0;
    p.dc_noise_V = 0.5;
    Sensors sensors(p, Board{}, 3);
    Sensors again(p, Board{}, 3);
    Sensors other(p, Board{}, 4);
    constexpr int count = 200000;
    double mean[6] = {}, square[6] = {}, product = 0.0;
    bool same = true;
    int different = 0;
    for (int k = 0; k < count; ++k) {
        const Words w = sampled(sensors, {1.0, 2.0, -3.0}, 50.0, 60.0, 200.0);
        const Words a = sampled(again, {1.0, 2.0, -3.0}, 50.0, 60.0, 200.0);
        same = same && w.i_u == a.i_u && w.i_w == a.i_w && w.u_dc == a.u_dc;
        different += w.i_u != sampled(other, {1.0, 2.0, -3.0}, 50.0, 60.0, 200.0).i_u;
        const double x[6] = {
            (w.i_u - 8192) * 25.0 / 8192 - 1.0,    (w.i_v - 8192) * 25.0 / 8192 - 2.0,
            (w.i_w - 8192) * 25.0 / 8192 + 3.0,    (w.u_uv - 8192) * 400.0 / 8192 - 50.0,
            (w.u_vw - 8192) * 400.0 / 8192 - 60.0, w.u_dc * 400.0 / 16384 - 200.0};
        for (int c = 0; c < 6; ++c) {
            mean[c] += x[c] / count;
            square[c] += x[c] * x[c] / count;
        }
        product += x[0] * x[1] / count;
    }
    CHECK(same);
    CHECK(different > count / 2);
    constexpr double sigma[6] = {0.05, 0.05, 0.05, 1.0, 1.0, 0.5};
    for (int c = 0; c < 6; ++c) {
        CHECK_NEAR(mean[c], 0.0, 0.015 * sigma[c]);
        CHECK_NEAR(std::sqrt(square[c]), sigma[c], 0.01 * sigma[c]);
    }
    CHECK_NEAR(product, 0.0, 0.015 * 0.05 * 0.05);
}

} // namespace

int main()
{
    return check::run({
        {"codes are those of the board formula", codes_are_those_of_the_board_formula},
        {"codes round to the nearest", codes_round_to_the_nearest},
        {"another board scales otherwise", another_board_scales_otherwise},
        {"gain and offset act per channel", gain_and_offset_act_per_channel},
        {"the step response is exact however time is cut",
         the_step_response_is_exact_however_time_is_cut},
        {"the series of a period is the transition", the_series_of_a_period_is_the_transition},
        {"the frequency response is that of Butterworth",
         the_frequency_response_is_that_of_butterworth},
        {"noise is the same everywhere", noise_is_the_same_everywhere},
        {"noise has the statistics it promises", noise_has_the_statistics_it_promises},
        {"channels carry their own noise", channels_carry_their_own_noise},
    });
}
