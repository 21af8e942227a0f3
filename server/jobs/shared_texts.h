/// SharedTexts: texts that many readers get, made once.
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

  /// The text about tile `tile` at event `seq`; make() -> std::string is called by the first who
  /// asks. Of each tile the newest is kept.
  template <typename Make>
  Text of(int tile, std::uint64_t seq, const Make& make) {
    {
      const core::MutexLock lock(mutex_);
      const auto found = texts_.find(tile);
      if (found != texts_.end() && found->second.seq == seq) {
        return found->second.text;
      }
    }
    // Two threads at the same moment do the work twice, and neither waits.
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
