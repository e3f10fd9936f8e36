// The measuring board: ADC, full scales, voltage filter, control period.
//
//   i = (code - 2^(n-1)) I_fs / 2^(n-1), positive into the motor; u_uv = u_u - u_v and u_vw = u_v -
//   u_w likewise, after the filter; u_dc = code U_fs / 2^n.
#ifndef ZH_BOARD_HPP
#define ZH_BOARD_HPP

#include <string>

#include "toml_reader.hpp"

namespace zh {

struct Board {
    int adc_bits = 14;
    double current_full_scale_A = 25.0;
    double line_voltage_full_scale_V = 400.0;
    double dc_link_full_scale_V = 400.0;
    double filter_cutoff_Hz = 800.0;
    double filter_damping = 0.70710678118654752; // Butterworth
    double period_s = 200e-6;
    int delay_periods = 1; // from the sample to the crest at which its duties begin to act
    double u_dc_V = 283.0; // nominal
    // Comparators on the phase currents open the gates without the firmware inside 2 us; 0: none.
    double comparator_A = 0.0;
};

Board read_board(const TomlDocument &document);
Board load_board(const std::string &path);

} // namespace zh

#endif
