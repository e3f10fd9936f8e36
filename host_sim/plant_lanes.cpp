#include "plant_lanes.hpp"

namespace zh {

// Empty lanes are computed as well and must not end in slow numbers.
PlantLanes::PlantLanes()
{
    constants_.pole_pairs.fill(1.0);
    constants_.y_ss.fill(1.0);
}

void PlantLanes::attach(std::size_t k, Plant *plant)
{
    if (fits_[k]) {
        plants_[k]->sensors_.set_noise(
            NoiseSource({noise_[0][k], noise_[1][k], noise_[2][k], noise_[3][k]}));
    }
    plants_[k] = plant;
    loaded_[k] = false;
    fits_[k] = false;
    packs_[k] = plant != nullptr && PlantPack::fits(*plant);
    if (plant == nullptr || !plant->fits_lanes()) {
        return;
    }
    fits_[k] = true;
    Constants &c = constants_;
    const LinearMotor &motor = plant->motor_.linear();
    c.Rr[k] = motor.Rr_ohm;
    c.pole_pairs[k] = motor.pole_pairs;
    c.y_ss[k] = motor.y_ss;
    c.y_sr[k] = motor.y_sr;
    c.y_rr[k] = motor.y_rr;
    const Friction &friction = plant->shaft_.friction();
    c.coulomb[k] = friction.coulomb_Nm;
    c.static_friction[k] = friction.static_Nm;
    c.viscous[k] = friction.viscous_Nms;
    c.inv_J[k] = friction.inv_J_per_kg_m2;
    c.dead_share[k] = plant->inverter_.dead_share();
    c.dead_time[k] = plant->inverter_.parameters().dead_time_s;
    c.inv_threshold[k] = plant->inverter_.leg().inv_threshold_per_A;
    c.drop[k] = plant->inverter_.leg().drop_V;
    c.period[k] = plant->period_s_;
    c.whole_p[k] = plant->whole_period_.p;
    c.whole_q[k] = plant->whole_period_.q;
    c.whole_r[k] = plant->whole_period_.r;
    attach_sensors(k, *plant);
}

void PlantLanes::attach_sensors(std::size_t k, const Plant &plant)
{
    Constants &c = constants_;
    const TransitionSeries &series = plant.filter_.series();
    for (std::size_t n = 0; n < series.p.size(); ++n) {
        c.series_p[n][k] = series.p[n];
        c.series_q[n][k] = series.q[n];
    }
    c.twice_damping[k] = series.twice_damping;
    const auto &channels = plant.sensors_.channels();
    for (std::size_t n = 0; n < channels.size(); ++n) {
        c.gain[n][k] = channels[n].gain;
        c.offset[n][k] = channels[n].offset;
        c.noise[n][k] = channels[n].noise;
    }
    for (std::size_t n = 0; n < noise_.size(); ++n) {
        noise_[n][k] = plant.sensors_.noise().state()[n];
    }
}

void PlantLanes::load(std::size_t k, const Plant &plant)
{
    State &s = state_;
    s.psi_s_alpha[k] = plant.x_.psi_s_Wb.alpha;
    s.psi_s_beta[k] = plant.x_.psi_s_Wb.beta;
    s.psi_r_alpha[k] = plant.x_.psi_r_Wb.alpha;
    s.psi_r_beta[k] = plant.x_.psi_r_Wb.beta;
    s.omega[k] = plant.x_.omega_m_rad_s;
    const LineVoltages &y = plant.filter_.state();
    s.uv[k] = y.uv_V;
    s.uv_slope[k] = y.uv_slope_V;
    s.vw[k] = y.vw_V;
    s.vw_slope[k] = y.vw_slope_V;
    s.i_before_alpha[k] = plant.i_s_before_A_.alpha;
    s.i_before_beta[k] = plant.i_s_before_A_.beta;
    loaded_[k] = true;
}

void PlantLanes::store(std::size_t k, Plant &plant) const
{
    const State &s = state_;
    plant.x_ = {
        {s.psi_s_alpha[k], s.psi_s_beta[k]}, {s.psi_r_alpha[k], s.psi_r_beta[k]}, s.omega[k]};
    plant.filter_.set_state({s.uv[k], s.uv_slope[k], s.vw[k], s.vw_slope[k]});
    plant.i_s_before_A_ = {s.i_before_alpha[k], s.i_before_beta[k]};
    plant.u_s_V_s_ = {s.u_s_alpha[k], s.u_s_beta[k]};
    plant.energy_J_ = s.energy[k];
    plant.shaft_.set_motion(s.direction[k], s.stuck[k] > 0.0);
}

// What acts in the coming interval.
void PlantLanes::plan(std::size_t k, Plant &plant, const Duty &duty)
{
    if (!loaded_[k]) {
        load(k, plant);
    }
    State &s = state_;
    s.u_s_alpha[k] = 0.0;
    s.u_s_beta[k] = 0.0;
    s.energy[k] = 0.0;
    Inputs &in = inputs_;
    in.Rs[k] = plant.motor_.linear().Rs_ohm;
    in.load[k] = plant.shaft_load_Nm_;
    in.u_dc[k] = plant.u_dc_V_;
    in.duty[0][k] = duty[0];
    in.duty[1][k] = duty[1];
    in.duty[2][k] = duty[2];
    if (plant.blocked_) {
        const Vec i_s_A = plant.motor_.linear().stator_current(plant.x_);
        s.i_before_alpha[k] = i_s_A.alpha;
        s.i_before_beta[k] = i_s_A.beta;
        plant.blocked_ = false;
    }
}

void PlantLanes::sample(PerLane<Words> &words)
{
    for (std::size_t k = 0; k < width; ++k) {
        if (fits_[k]) {
            inputs_.u_dc[k] = plants_[k]->u_dc_V_;
            if (!loaded_[k]) {
                load(k, *plants_[k]);
            }
        } else if (plants_[k] != nullptr) {
            words[k] = plants_[k]->sample();
        }
    }
    convert();
    for (std::size_t k = 0; k < width; ++k) {
        if (fits_[k]) {
            const Codes codes{codes_[0][k], codes_[1][k], codes_[2][k],
                              codes_[3][k], codes_[4][k], codes_[5][k]};
            words[k] = plants_[k]->faulty_sensors_.apply(codes, plants_[k]->time_s());
        }
    }
}

void PlantLanes::advance(const PerLane<PlantCommand> &commands)
{
    PerLane<Plant::Interval> intervals{};
    for (std::size_t k = 0; k < width; ++k) {
        if (plants_[k] != nullptr) {
            intervals[k] = plants_[k]->begin_interval(commands[k].gates_on);
        }
    }
    step_together(Plant::Interval::averaged, commands, intervals);
    step_together(Plant::Interval::switched, commands, intervals);
    step_in_packs(Plant::Interval::averaged, commands, intervals);
    step_in_packs(Plant::Interval::switched, commands, intervals);
    for (std::size_t k = 0; k < width; ++k) {
        if (plants_[k] != nullptr) {
            if (intervals[k] != Plant::Interval::none) {
                plants_[k]->step_interval(intervals[k], commands[k].duty);
                loaded_[k] = false;
            }
            plants_[k]->end_interval(commands[k].brake_on);
        }
    }
}

// The intervals that are done become `none`, here and below.
void PlantLanes::step_in_packs(Plant::Interval kind, const PerLane<PlantCommand> &commands,
                               PerLane<Plant::Interval> &intervals)
{
    for (std::size_t k = 0; k < width; ++k) {
        if (packs_[k] && intervals[k] == kind) {
            pack_.add(*plants_[k], kind, commands[k].duty);
            intervals[k] = Plant::Interval::none;
        }
        if (pack_.full() || (k + 1 == width && !pack_.empty())) {
            pack_.step();
        }
    }
}

void PlantLanes::step_together(Plant::Interval kind, const PerLane<PlantCommand> &commands,
                               PerLane<Plant::Interval> &intervals)
{
    PerLane<bool> joins{};
    bool any = false;
    for (std::size_t k = 0; k < width; ++k) {
        joins[k] =
            intervals[k] == kind && fits_[k] &&
            (kind == Plant::Interval::averaged || plants_[k]->inverter_.plain(commands[k].duty));
        if (joins[k]) {
            plan(k, *plants_[k], commands[k].duty);
            any = true;
        }
    }
    if (!any) {
        return;
    }
    if (kind == Plant::Interval::averaged) {
        step_averaged();
    } else {
        schedule();
        step_switched();
    }
    for (std::size_t k = 0; k < width; ++k) {
        loaded_[k] = joins[k];
        if (joins[k]) {
            store(k, *plants_[k]);
            intervals[k] = Plant::Interval::none;
        }
    }
}

} // namespace zh
