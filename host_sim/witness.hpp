// Somebody beside the SIL firmware who is given every sample and answers with duties of his own.
#ifndef ZH_WITNESS_HPP
#define ZH_WITNESS_HPP

#include "firmware_headers.hpp"

namespace zh {

class Witness {
public:
    virtual ~Witness() = default;
    // Before the firmware's period: the sample and command it is about to get. Late periods are the
    // witness's to count.
    virtual void ask(hal_sample_t &sample, const unit_command_t &command) = 0;
    // After it: the witness's output, which the plant then gets. False ends the run.
    virtual bool answer(const unit_t &unit, hal_output_t &output) = 0;
};

} // namespace zh

#endif
