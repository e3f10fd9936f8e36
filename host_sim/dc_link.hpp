// The dc link: a capacitor fed through a rectifier, which lets nothing back, with a brake resistor.
//
//   C du/dt = max(0, (source - u) / R_source) - P / u - (chopper on) u / R_chopper
// P is what the legs hand to the motor, negative while it brakes. Section [dc_link] of a rig;
// without a capacitance the link is stiff, at the source's voltage. The source may ripple, as that
// of a rectifier does at twice or six times the mains frequency.
#ifndef ZH_DC_LINK_HPP
#define ZH_DC_LINK_HPP

#include <algorithm>

namespace zh {

struct DcLinkParameters {
    double capacitance_F = 0.0; // 0: stiff
    double source_ohm = 0.5;    // mains, rectifier and choke
    double chopper_ohm = 0.0;   // 0: no brake resistor
    double ripple_pu = 0.0;     // amplitude of the source's ripple over its voltage
    double ripple_Hz = 0.0;
};

class DcLink {
public:
    static constexpr int parts = 10; // integration steps of a control period

    DcLink(const DcLinkParameters &parameters, double u_dc_V) : p_(parameters), u_dc_V_(u_dc_V)
    {
    }
    double u_dc_V() const
    {
        return u_dc_V_;
    }
    double ripple_Hz() const
    {
        return p_.ripple_Hz;
    }
    bool ripples() const
    {
        return p_.ripple_pu > 0.0;
    }
    // A stiff link follows at once, before the interval that it acts in.
    // ripple_sine: of ripple_Hz at that time; of no matter without ripple.
    void follow(double mean_V, double ripple_sine)
    {
        const double ripple_pu = ripples() ? p_.ripple_pu * ripple_sine : 0.0;
        const double source_V = mean_V * (1.0 + ripple_pu);
        source_V_ = source_V;
        if (!(p_.capacitance_F > 0.0)) {
            u_dc_V_ = source_V;
        }
    }
    // The interval that ended, with its mean power.
    void advance(double power_W, bool chopper_on, double period_s)
    {
        if (!(p_.capacitance_F > 0.0)) {
            return;
        }
        const double brake_S = chopper_on && p_.chopper_ohm > 0.0 ? 1.0 / p_.chopper_ohm : 0.0;
        const double share = period_s / (parts * p_.capacitance_F);
        for (int n = 0; n < parts; ++n) {
            const double source_A = std::max(0.0, (source_V_ - u_dc_V_) / p_.source_ohm);
            const double legs_A = power_W / std::max(u_dc_V_, lowest_V);
            u_dc_V_ = std::max(0.0, u_dc_V_ + share * (source_A - legs_A - brake_S * u_dc_V_));
        }
    }

private:
    static constexpr double lowest_V = 1.0; // an empty link gives no power

    DcLinkParameters p_;
    double u_dc_V_;
    double source_V_ = 0.0;
};

} // namespace zh

#endif
