#include "experiment.hpp"

#include <algorithm>
#include <array>

namespace zh {

ExperimentFiles ExperimentFiles::load(const std::string &rig_path, const std::string &board_path,
                                      const std::string &scenario_path)
{
    return {TomlDocument::from_file(rig_path), TomlDocument::from_file(board_path),
            TomlDocument::from_file(scenario_path)};
}

void ExperimentFiles::set(std::string_view assignment)
{
    constexpr std::array<std::string_view, 7> rig_sections{
        "rig", "motor", "mechanics", "inverter", "dc_link", "sensors", "integration"};
    constexpr std::array<std::string_view, 5> scenario_sections{"scenario", "profiles", "faults",
                                                                "firmware", "controller_motor"};
    const auto in = [](const auto &sections, std::string_view word) {
        return std::find(sections.begin(), sections.end(), word) != sections.end();
    };
    const std::size_t dot = assignment.find('.');
    const std::string_view first = assignment.substr(0, dot);
    if (dot != std::string_view::npos && first == "board") {
        board.set(assignment.substr(dot + 1));
    } else if (in(rig_sections, first)) {
        rig.set(assignment);
    } else if (in(scenario_sections, first)) {
        scenario.set(assignment);
    } else {
        throw ConfigError("override: '" + std::string(assignment) +
                          "': belongs to no file; start with motor, mechanics, inverter, dc_link, "
                          "sensors, integration, scenario, profiles, faults, firmware, "
                          "controller_motor or board");
    }
}

} // namespace zh
