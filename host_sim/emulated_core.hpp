// The flash image on an emulated core, behind two FIFOs (hal/qemu_mps2/pil_protocol.h).
#ifndef ZH_EMULATED_CORE_HPP
#define ZH_EMULATED_CORE_HPP

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "firmware.hpp"
#include "pil.h"
#include "lockstep_peer.hpp"
#include "pil_protocol.h"

namespace zh {

class EmulatedCore : public LockstepPeer {
public:
    // Waits for the image in `folder`; throws ConfigError when it does not come, is of other
    // sources, carries another gain table, or refuses the parameters.
    EmulatedCore(const zh_pil_job &job, const params_t &params, const GainFile &gain,
                 zh_pil_result &result);
    EmulatedCore(const EmulatedCore &) = delete;
    EmulatedCore &operator=(const EmulatedCore &) = delete;
    ~EmulatedCore() override;

    void ask(hal_sample_t &sample, unit_command_t &command) override;
    bool answer(const unit_t &unit, hal_output_t &output) override;
    // Tells the image to leave and takes its last words.
    void finish();
    std::vector<zh_pil_period> take_periods();

private:
    bool there_is_something() const;
    bool read(void *data, std::size_t n);
    bool hear();
    void name_difference(const std::uint32_t *host, const std::uint32_t *image);
    bool write(const void *data, std::size_t n);
    void introduce(const zh_pil_job &job, const params_t &params, const GainFile &gain);

    zh_pil_result &result_;
    std::vector<zh_pil_period> periods_;
    std::ofstream words_;
    pil_out_t out_{};
    bool heard_ = false; // out_ is this period's
    bool bus_ = false;   // the image says what it is commanded
    std::uint16_t late_periods_ = 0;
    bool injecting_ = false; // an image with a defect may go its own way: see how it ends
    int to_image_ = -1;
    int from_image_ = -1;
};

} // namespace zh

#endif
