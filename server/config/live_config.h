/// LiveConfig: the effective configuration, replaced as a whole on reload.
#pragma once

#include <memory>
#include <utility>

#include "core/base/mutex.h"
#include "server/config/config.h"

namespace server {

class LiveConfig {
 public:
  explicit LiveConfig(Config config) : config_(std::make_shared<const Config>(std::move(config))) {}
  LiveConfig(const LiveConfig&) = delete;
  LiveConfig& operator=(const LiveConfig&) = delete;

  std::shared_ptr<const Config> now() const {
    const core::MutexLock lock(mutex_);
    return config_;
  }
  void set(Config config) {
    auto next = std::make_shared<const Config>(std::move(config));
    const core::MutexLock lock(mutex_);
    config_.swap(next);
  }

 private:
  mutable core::Mutex mutex_;
  std::shared_ptr<const Config> config_ GUARDED_BY(mutex_);
};

}  // namespace server
