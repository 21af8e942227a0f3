/// Blocks all signals on this thread for the lifetime of the object. Threads created during it
/// inherit the mask, so that signals reach only the application's threads.
#pragma once

#include <csignal>

namespace server {

class SignalBlock {
 public:
  SignalBlock() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalBlock() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalBlock(const SignalBlock&) = delete;
  SignalBlock& operator=(const SignalBlock&) = delete;

 private:
  sigset_t before_ = {};
};

}  // namespace server
