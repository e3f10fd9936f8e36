// l_gain.json of a motor, word for word as the designer stored it, checked and shared.
#ifndef ZH_GAIN_FILE_HPP
#define ZH_GAIN_FILE_HPP

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "law_headers.hpp"

namespace zh {

// T-equivalent circuit the table was designed for.
struct Circuit {
    double Rs_ohm = 0.0;
    double Rr_ohm = 0.0;
    double Ls_H = 0.0;
    double Lr_H = 0.0;
    double M_H = 0.0;

    bool operator==(const Circuit &) const = default;
};

// The table the firmware reads, and the memory it lies in.
class GainFile {
public:
    GainFile(std::string motor_name, const Circuit &designed_for, double designed_period_s,
             std::vector<observer_gain_t> entries, float step_rad_s);
    GainFile(const GainFile &) = delete;
    GainFile &operator=(const GainFile &) = delete;

    const std::string motor;
    const Circuit circuit;
    // The Euler disc is proven for this control period, and so for any shorter one.
    const double period_s;
    const gain_table_t &table() const
    {
        return table_;
    }

private:
    std::vector<observer_gain_t> entries_;
    gain_table_t table_;
};

// Reads and checks the file: schema, number of words, CRC-32C, finite gains. Throws ConfigError.
// Read once per content: thousands of drives share one copy, from any thread.
std::shared_ptr<const GainFile> load_gain_file(const std::string &path);

// A table that is not in a file (a search): 4 N floats, L of one entry after the other, every 2
// elec. min^-1.
std::shared_ptr<const GainFile> gain_from_floats(std::span<const float> words);

} // namespace zh

#endif
