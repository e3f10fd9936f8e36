#include "plant_pack.hpp"

namespace zh {

bool PlantPack::fits(const Plant &plant)
{
    const Faults &f = plant.disturbances_.faults;
    const bool plain = !(f.short_s < never_s) && !(f.earth_s < never_s) && !plant.crossed() &&
                       f.dead_leg == no_leg && plant.substeps_ == 0;
    return plain && plant.motor_.general_ && plant.motor_.method_ == IntegrationMethod::rk4 &&
           !plant.inverter_.ideal_devices() && plant.filter_.series_fits();
}

void PlantPack::add_constants(std::size_t k, const Plant &plant)
{
    const InductionMotor &motor = plant.motor_;
    c_.Rs[k] = motor.linear_.Rs_ohm;
    c_.Rr[k] = motor.linear_.Rr_ohm;
    c_.pole_pairs[k] = motor.linear_.pole_pairs;
    c_.y_ss[k] = motor.linear_.y_ss;
    c_.y_sr[k] = motor.linear_.y_sr;
    c_.y_rr[k] = motor.linear_.y_rr;
    c_.iron_siemens[k] = motor.iron_siemens_;
    c_.rotor_share[k] = motor.rotor_share_;
    c_.leak_r[k] = motor.branch_.leak_r_H;
    c_.inv_M[k] = motor.branch_.inv_M;
    c_.inv_knee2[k] = motor.branch_.inv_knee2;
    c_.inv_leak_s[k] = motor.branch_.inv_leak_s;
    c_.ratio[k] = motor.branch_.ratio;
    c_.start[k] = motor.branch_.start;
    c_.law[k] = static_cast<double>(motor.law_);
    c_.exponent[k] = 2.0 * static_cast<double>(motor.law_);
    soft_ = soft_ || motor.law_ == SaturationLaw::soft;
    const Friction &friction = plant.shaft_.friction();
    c_.coulomb[k] = friction.coulomb_Nm;
    c_.static_friction[k] = friction.static_Nm;
    c_.viscous[k] = friction.viscous_Nms;
    c_.inv_J[k] = friction.inv_J_per_kg_m2;
    const Inverter &inverter = plant.inverter_;
    c_.inv_threshold[k] = inverter.leg().inv_threshold_per_A;
    c_.drop[k] = inverter.leg().drop_V;
    c_.drop_difference[k] = inverter.devices().drop_difference_V;
    c_.on_ohm[k] = inverter.devices().on_ohm;
    c_.dead_s_per_F[k] = inverter.devices().dead_s_per_F;
    c_.load[k] = plant.shaft_load_Nm_;
    c_.u_dc[k] = plant.u_dc_V_;
}

void PlantPack::add_state(std::size_t k, const Plant &plant)
{
    const auto set = [k](FourVec &to, Vec from) {
        to.alpha[k] = from.alpha;
        to.beta[k] = from.beta;
    };
    const MotorCurrents i = plant.motor_.currents(plant.x_);
    set(s_.psi_s, plant.x_.psi_s_Wb);
    set(s_.psi_r, plant.x_.psi_r_Wb);
    set(s_.i_s, i.i_s_A);
    set(s_.i_r, i.i_r_A);
    set(s_.psi_m, i.psi_m_Wb);
    set(s_.u_s, plant.u_s_V_s_);
    set(i_legs_, i.i_s_A);
    s_.omega[k] = plant.x_.omega_m_rad_s;
    const LineVoltages &y = plant.filter_.state();
    s_.uv[k] = y.uv_V;
    s_.uv_slope[k] = y.uv_slope_V;
    s_.vw[k] = y.vw_V;
    s_.vw_slope[k] = y.vw_slope_V;
    s_.energy[k] = plant.energy_J_;
    s_.direction[k] = 0.0;
    s_.stuck[k] = 0.0;
}

PlantPack::Stretch &PlantPack::stretch(std::size_t k, std::size_t n, const Segment &segment,
                                       double h_s)
{
    if (n == steps_) {
        stretch_[steps_++].taken = Four{}; // the rest is of no use, but made of numbers
    }
    Stretch &s = stretch_[n];
    for (std::size_t x = 0; x < 3; ++x) {
        s.level[x][k] = segment.level[x];
        s.dead[x][k] = segment.dead[x];
    }
    s.h_s[k] = h_s;
    s.taken[k] = 1.0;
    return s;
}

void PlantPack::add(Plant &plant, Plant::Interval interval, const Duty &duty)
{
    const std::size_t k = count_++;
    if (k == 0) {
        soft_ = false;
        switched_ = false;
    }
    plants_[k] = &plant;
    add_constants(k, plant);
    add_state(k, plant);
    std::size_t n = 0;
    if (interval == Plant::Interval::switched) {
        switched_ = true;
        plant.blocked_ = false;
        const TransitionSeries &series = plant.filter_.series();
        for (std::size_t i = 0; i < series.p.size(); ++i) {
            series_p_[i][k] = series.p[i];
            series_q_[i][k] = series.q[i];
        }
        twice_damping_[k] = series.twice_damping;
        for (const Segment &segment : plant.inverter_.schedule(duty)) {
            const int parts = plant.parts_of(segment.h_s);
            for (int part = 0; part < parts; ++part) {
                stretch(k, n++, segment, segment.h_s / parts);
            }
        }
        return;
    }
    const Segment half = plant.inverter_.averaged_half(duty);
    const Vec i_s{s_.i_s.alpha[k], s_.i_s.beta[k]};
    const Vec i_mid = plant.blocked_ ? i_s : i_s + 0.5 * (i_s - plant.i_s_before_A_);
    plant.blocked_ = false;
    plant.i_s_before_A_ = i_s;
    const auto steps = [&](double h_s, const FilterTransition &e) {
        Stretch &s = stretch(k, n++, half, h_s);
        s.p[k] = e.p;
        s.q[k] = e.q;
        s.r[k] = e.r;
    };
    if (plant.whole_steps_) {
        i_legs_.alpha[k] = i_mid.alpha;
        i_legs_.beta[k] = i_mid.beta;
        steps(plant.period_s_, plant.whole_period_);
        return;
    }
    steps(half.h_s, plant.half_period_);
    steps(half.h_s, plant.half_period_);
}

void PlantPack::give(std::size_t k, Plant &plant) const
{
    const auto vec = [k](const FourVec &v) { return Vec{v.alpha[k], v.beta[k]}; };
    plant.x_ = {vec(s_.psi_s), vec(s_.psi_r), s_.omega[k]};
    plant.filter_.set_state({s_.uv[k], s_.uv_slope[k], s_.vw[k], s_.vw_slope[k]});
    plant.u_s_V_s_ = vec(s_.u_s);
    plant.energy_J_ = s_.energy[k];
    plant.shaft_.set_motion(s_.direction[k], s_.stuck[k] > 0.0);
    if (plant.motor_.saturated_) {
        plant.motor_.last_ = {plant.x_, {vec(s_.i_s), vec(s_.i_r), vec(s_.psi_m)}};
    }
}

void PlantPack::step()
{
    // An empty place repeats the first plant, whose numbers are none that are slow.
    for (std::size_t k = count_; k < width; ++k) {
        add_constants(k, *plants_[0]);
        add_state(k, *plants_[0]);
    }
    step_all();
    for (std::size_t k = 0; k < count_; ++k) {
        give(k, *plants_[k]);
    }
    clear();
}

} // namespace zh
