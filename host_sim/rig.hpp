// A test rig: the true motor, shaft, inverter and sensors. Its file is host_sim/rigs/<name>.toml.
#ifndef ZH_RIG_HPP
#define ZH_RIG_HPP

#include <string>

#include "dc_link.hpp"
#include "induction_motor.hpp"
#include "inverter.hpp"
#include "load.hpp"
#include "sensors.hpp"
#include "toml_reader.hpp"

namespace zh {

// How the plant is stepped, to show that nothing depends on it.
struct Integration {
    IntegrationMethod method = IntegrationMethod::rk4;
    // Equal steps per control period (switched: at least; a switching instant ends one); 0: one or
    // two, as plant.cpp finds enough.
    int substeps = 0;
};

struct Rig {
    std::string name;
    MotorParameters motor;
    Mechanics mechanics;
    InverterParameters inverter;
    DcLinkParameters dc_link;
    SensorParameters sensors;
    Integration integration;
};

Rig read_rig(const TomlDocument &document);
Rig load_rig(const std::string &path);

} // namespace zh

#endif
