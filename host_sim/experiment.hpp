// The three files of a run, parsed once, with overrides applied to copies: what a search needs.
#ifndef ZH_EXPERIMENT_HPP
#define ZH_EXPERIMENT_HPP

#include <string>
#include <string_view>

#include "board.hpp"
#include "rig.hpp"
#include "scenario.hpp"
#include "toml_reader.hpp"

namespace zh {

struct ExperimentFiles {
    TomlDocument rig;
    TomlDocument board;
    TomlDocument scenario;

    static ExperimentFiles load(const std::string &rig_path, const std::string &board_path,
                                const std::string &scenario_path);
    // "key=value". The first word of the dotted key chooses the file: motor, mechanics, inverter,
    // sensors, integration -> rig; scenario, profiles, firmware, controller_motor -> scenario;
    // board.<section>.<key>
    // -> board. Any other first word is refused here, a wrong key when the document is read.
    void set(std::string_view assignment);
};

} // namespace zh

#endif
