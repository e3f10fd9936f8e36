// A test rig: the true motor, shaft, inverter and sensors. Its file is host_sim/rigs/<name>.toml.
#ifndef ZH_RIG_HPP
#define ZH_RIG_HPP

#include <string>

#include "induction_motor.hpp"
#include "inverter.hpp"
#include "load.hpp"
#include "sensors.hpp"
#include "toml_reader.hpp"

namespace zh {

struct Rig {
    std::string name;
    MotorParameters motor;
    Mechanics mechanics;
    InverterParameters inverter;
    SensorParameters sensors;
};

Rig read_rig(const TomlDocument &document);
Rig load_rig(const std::string &path);

} // namespace zh

#endif
