/// SharedTexts: texts sent to many readers, each generated once.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "core/base/mutex.h"

namespace server {

class SharedTexts {
 public:
  using Text = std::shared_ptr<const std::string>;

  /// Returns the text for tile `tile` at event `seq`; the first caller runs make() -> std::string.
  /// Keeps the newest text of each tile.
  template <typename Make>
  Text of(int tile, std::uint64_t seq, const Make& make) {
    {
      const core::MutexLock lock(mutex_);
      const auto found = texts_.find(tile);
      if (found != texts_.end() && found->second.seq == seq) {
        return found->second.text;
      }
    }
    // Two threads may both generate the text; neither waits.
    Text text = std::make_shared<const std::string>(make());
    const core::MutexLock lock(mutex_);
    Entry& entry = texts_[tile];
    if (entry.seq <= seq) {
      entry = Entry{.seq = seq, .text = text};
    }
    return text;
  }

 private:
  struct Entry {
    std::uint64_t seq = 0;
    Text text;
  };
  core::Mutex mutex_;
  std::map<int, Entry> texts_ GUARDED_BY(mutex_);
};

}  // namespace server
