// Runs in lockstep with the SIL firmware: gets every sample and answers with duties of its own.
#ifndef ZH_LOCKSTEP_PEER_HPP
#define ZH_LOCKSTEP_PEER_HPP

#include "firmware_headers.hpp"

namespace zh {

class LockstepPeer {
public:
    virtual ~LockstepPeer() = default;
    // Before the firmware's period: the sample and command it is about to get, the latter perhaps
    // the peer's own. Late periods are the peer's to count.
    virtual void ask(hal_sample_t &sample, unit_command_t &command) = 0;
    // After it: the peer's output, which the plant then gets. False ends the run.
    virtual bool answer(const unit_t &unit, hal_output_t &output) = 0;
};

} // namespace zh

#endif
