#include "board.hpp"

namespace zh {

Board read_board(const TomlDocument &document)
{
    TomlReader in(document);
    Board board;
    in.text_or("board.name", "");
    board.adc_bits = in.integer("adc.bits", 8, 16);
    board.current_full_scale_A = in.number("full_scale.current_A", positive(1e4));
    board.line_voltage_full_scale_V = in.number("full_scale.line_voltage_V", positive(1e5));
    board.dc_link_full_scale_V = in.number("full_scale.dc_link_V", positive(1e5));
    board.filter_cutoff_Hz = in.number("filter.voltage_cutoff_Hz", within(10.0, 1e5));
    in.integer("filter.order", 2, 2);
    board.filter_damping =
        in.number_or("filter.voltage_damping", board.filter_damping, within(0.1, 10.0));
    board.period_s = in.number("control.period_s", within(1e-6, 1e-2));
    board.delay_periods = in.integer_or("control.delay_periods", 1, 1, 2);
    board.u_dc_V = in.number("inverter.u_dc_V", positive(1e5));
    if (board.u_dc_V > board.dc_link_full_scale_V) {
        in.reject("inverter.u_dc_V", "is above full_scale.dc_link_V", "raise the full scale");
    }
    board.comparator_A = in.number_or("protection.comparator_A", 0.0, not_negative(1e4));
    in.finish();
    return board;
}

Board load_board(const std::string &path)
{
    return read_board(TomlDocument::from_file(path));
}

} // namespace zh
