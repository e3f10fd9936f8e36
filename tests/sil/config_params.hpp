// [params] of a configuration, as the overrides that a job takes.
#ifndef ZH_CONFIG_PARAMS_HPP
#define ZH_CONFIG_PARAMS_HPP

#include <algorithm>
#include <fstream>
#include <string>

namespace zh {

// name: a file of host_sim/configs, without .toml; empty when there is none.
inline std::string params_of(const std::string &name)
{
    std::ifstream file(std::string(ZH_ROOT) + "/host_sim/configs/" + name + ".toml");
    std::string all;
    bool inside = false;
    for (std::string line; std::getline(file, line);) {
        if (!line.empty() && line[0] == '[') {
            inside = line == "[params]";
        } else if (inside && line.find('=') != std::string::npos && line[0] != '#') {
            line.erase(std::remove(line.begin(), line.end(), ' '), line.end());
            all += line.substr(0, line.find('#')) + "\n";
        }
    }
    return all;
}

} // namespace zh

#endif
