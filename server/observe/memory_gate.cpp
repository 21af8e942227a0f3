#include "server/observe/memory_gate.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <utility>

#include <malloc.h>

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

using Clock = std::chrono::steady_clock;

/// The allocator keeps freed memory; it is trimmed after this share of the limit was freed.
constexpr std::uint64_t kTrimShare = 16;
/// A tenant with at most this share of the limit holds little...
constexpr std::uint64_t kLittleShare = 64;
/// ... and may use this share beyond the limit.
constexpr std::uint64_t kExtraShare = 16;

}  // namespace

std::string memory_words(std::uint64_t bytes) {
  std::array<char, 32> text{};
  const auto value = static_cast<double>(bytes);
  static_cast<void>(bytes < 1'000'000'000
                        ? std::snprintf(text.data(), text.size(), "%.3g MB", value / 1e6)
                        : std::snprintf(text.data(), text.size(), "%.3g GB", value / 1e9));
  return text.data();
}

struct MemoryGate::Room {
  struct Held {
    MemoryUse use;
    Kind kind = Kind::kNeeded;
  };
  /// Bytes declared by the holders of one name; the largest counts.
  struct Name {
    std::multiset<std::uint64_t> needed;
    std::multiset<std::uint64_t> idle;
  };
  struct Total {
    std::uint64_t all = 0;
    std::uint64_t needed = 0;
  };

  /// A request that waits for memory.
  struct Waiting {
    std::uint64_t id = 0;  ///< of its lease
    std::string tenant;
  };

  explicit Room(std::uint64_t bytes) : bytes_max(bytes) {}

  const std::uint64_t bytes_max;
  core::Mutex mutex;
  core::CondVar freed;
  std::uint64_t last_id GUARDED_BY(mutex) = 0;
  std::map<std::uint64_t, Held> held GUARDED_BY(mutex);
  std::map<std::string, Name> names GUARDED_BY(mutex);
  std::map<std::string, std::uint64_t> bytes_of_tenant GUARDED_BY(mutex);
  std::vector<Waiting> waiting GUARDED_BY(mutex);
  Total total GUARDED_BY(mutex);
  std::uint64_t freed_bytes GUARDED_BY(mutex) = 0;  ///< Since the last malloc_trim().
  std::vector<std::function<bool()>> reclaimers GUARDED_BY(mutex);

  static std::uint64_t largest(const std::multiset<std::uint64_t>& bytes) {
    return bytes.empty() ? 0 : *bytes.rbegin();
  }
  static Total of(const Name& name) {
    return {.all = std::max(largest(name.needed), largest(name.idle)),
            .needed = largest(name.needed)};
  }

  void count(const Held& what, bool comes) REQUIRES(mutex) {
    const auto add = [comes](std::uint64_t& to, std::uint64_t bytes) {
      to = comes ? to + bytes : to - bytes;
    };
    add(total.all, what.use.bytes);
    if (!what.use.tenant.empty()) {
      std::uint64_t& of_tenant = bytes_of_tenant[what.use.tenant];
      add(of_tenant, what.use.bytes);
      if (of_tenant == 0) {
        bytes_of_tenant.erase(what.use.tenant);
      }
    }
    add(total.needed, what.kind == Kind::kNeeded ? what.use.bytes : 0);
    for (const auto& [key, bytes] : what.use.shared) {
      Name& name = names[key];
      const Total before = of(name);
      auto& sizes = what.kind == Kind::kNeeded ? name.needed : name.idle;
      if (comes) {
        sizes.insert(bytes);
      } else {
        sizes.erase(sizes.find(bytes));
      }
      const Total after = of(name);
      total.all += after.all - before.all;  // Unsigned arithmetic wraps back.
      total.needed += after.needed - before.needed;
      if (name.needed.empty() && name.idle.empty()) {
        names.erase(key);
      }
    }
  }

  /// Returns the total if the lease had this use; changes nothing.
  Total total_with(std::uint64_t id, const MemoryUse& use) REQUIRES(mutex) {
    const auto found = held.find(id);
    const Held next{.use = use};
    if (found != held.end()) {
      count(found->second, false);
    }
    count(next, true);
    const Total with = total;
    count(next, false);
    if (found != held.end()) {
      count(found->second, true);
    }
    return with;
  }

  void set(std::uint64_t id, Held next) REQUIRES(mutex) {
    const std::uint64_t before = total.all;
    if (const auto found = held.find(id); found != held.end()) {
      count(found->second, false);
    }
    count(next, true);
    held[id] = std::move(next);
    note_freed(before);
  }
  void note_freed(std::uint64_t before) REQUIRES(mutex) {
    if (total.all < before) {
      freed_bytes += before - total.all;
      freed.notify_all();
    }
  }
  void remove(std::uint64_t id) {
    const core::MutexLock lock(mutex);
    const std::uint64_t before = total.all;
    const auto found = held.find(id);
    count(found->second, false);
    held.erase(found);
    note_freed(before);
  }

  static std::string needs_text(std::uint64_t bytes, std::string_view what) {
    return std::string(what) + " needs " + memory_words(bytes) + " of memory";
  }
  Status check(std::uint64_t bytes, std::string_view what) const {
    return is_within(bytes, 0)
               ? core::ok_status()
               : Status(Error{ErrorCode::kTooLarge,
                              needs_text(bytes, what) +
                                  "; the limit for all requests and jobs of this server is " +
                                  memory_words(bytes_max) + " (--memory)",
                              ""});
  }
  bool is_within(std::uint64_t bytes, std::uint64_t most) const {
    return bytes_max == 0 || bytes <= (most == 0 ? bytes_max : most);
  }
  std::uint64_t held_by(const std::string& tenant) const REQUIRES(mutex) {
    const auto found = bytes_of_tenant.find(tenant);
    return found == bytes_of_tenant.end() ? 0 : found->second;
  }
  /// Returns the limit for a request that grows to `use`, from what it has.
  std::uint64_t limit_of(const MemoryUse& had, const MemoryUse& use) const REQUIRES(mutex) {
    return use.tenant.empty() ? bytes_max
                              : limit_of_all(held_by(use.tenant) - had.bytes + use.bytes);
  }
  /// Returns the limit for a tenant that then holds so much.
  std::uint64_t limit_of_all(std::uint64_t bytes) const {
    return bytes_max + (bytes <= bytes_max / kLittleShare ? bytes_max / kExtraShare : 0);
  }
  /// Whether a tenant that holds less than `tenant` waits.
  bool has_before(const std::string& tenant) const REQUIRES(mutex) {
    return std::any_of(waiting.begin(), waiting.end(),
                       [&](const Waiting& each) TESSERA_TS(no_thread_safety_analysis) {
                         return each.tenant != tenant && held_by(each.tenant) < held_by(tenant);
                       });
  }
  /// Returns freed memory to the system before more is allocated.
  void trim() {
    {
      const core::MutexLock lock(mutex);
      if (bytes_max == 0 || freed_bytes < bytes_max / kTrimShare) {
        return;
      }
      freed_bytes = 0;
    }
    ::malloc_trim(0);
  }
  /// Releases one idle object; returns false if there is none.
  bool reclaim() {
    std::vector<std::function<bool()>> each;
    {
      const core::MutexLock lock(mutex);
      each = reclaimers;
    }
    return std::any_of(each.begin(), each.end(), [](const auto& drop_one) { return drop_one(); });
  }
  Fit try_set(std::uint64_t id, const MemoryUse& use, std::uint64_t most) {
    trim();
    const core::MutexLock lock(mutex);
    const std::uint64_t limit = most == 0 ? limit_of(held.at(id).use, use) : most;
    const bool is_little = limit > bytes_max;
    if (!use.tenant.empty() && !is_little && has_before(use.tenant)) {
      return Fit::kNo;
    }
    const Total with = total_with(id, use);
    if (is_within(with.all, limit)) {
      set(id, Held{.use = use});
      return Fit::kYes;
    }
    return is_within(with.needed, limit) ? Fit::kWithoutIdle : Fit::kNo;
  }
  bool set_or_reclaim(std::uint64_t id, const MemoryUse& use) {
    Fit fit = try_set(id, use, 0);
    while (fit == Fit::kWithoutIdle && reclaim()) {
      fit = try_set(id, use, 0);
    }
    return fit == Fit::kYes;
  }
  Status wait_to_set(std::uint64_t id, const MemoryUse& use, std::string_view what,
                     std::chrono::milliseconds patience) {
    std::uint64_t bytes = use.bytes;
    for (const auto& [name, more] : use.shared) {
      bytes += more;
    }
    if (auto fits = check(bytes, what); !fits) {
      return fits;
    }
    if (set_or_reclaim(id, use)) {
      return core::ok_status();
    }
    if (!use.tenant.empty()) {
      const core::MutexLock lock(mutex);
      waiting.push_back({id, use.tenant});
    }
    const Status taken = wait_for_room(id, use, needs_text(bytes, what), patience);
    const core::MutexLock lock(mutex);
    std::erase_if(waiting, [id](const Waiting& each) { return each.id == id; });
    freed.notify_all();
    return taken;
  }
  Status wait_for_room(std::uint64_t id, const MemoryUse& use, const std::string& needs,
                       std::chrono::milliseconds patience) {
    const auto deadline = Clock::now() + patience;
    while (!set_or_reclaim(id, use)) {
      const core::MutexLock lock(mutex);
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
      if (left.count() <= 0) {
        return Error{ErrorCode::kUnavailable,
                     needs + ", and " + memory_words(total.all) + " of " + memory_words(bytes_max) +
                         " are in use (--memory); try again",
                     ""};
      }
      // Memory may have been freed between the check and this wait, so the wait is short.
      static_cast<void>(freed.wait_for(mutex, std::min(left, std::chrono::milliseconds(100))));
    }
    return core::ok_status();
  }
};

MemoryGate::MemoryGate(std::uint64_t bytes_max)
    : bytes_max_(bytes_max), room_(std::make_shared<Room>(bytes_max)) {}

MemoryGate::Lease::Lease(Lease&& other) noexcept
    : room_(std::move(other.room_)), id_(other.id_), what_(std::move(other.what_)) {}

MemoryGate::Lease& MemoryGate::Lease::operator=(Lease&& other) noexcept {
  std::swap(room_, other.room_);
  std::swap(id_, other.id_);
  std::swap(what_, other.what_);
  return *this;
}

MemoryGate::Lease::~Lease() {
  if (room_) {
    room_->remove(id_);
  }
}

std::uint64_t MemoryGate::Lease::bytes() const {
  if (!room_) {
    return 0;
  }
  const core::MutexLock lock(room_->mutex);
  return room_->held.at(id_).use.bytes;
}

Status MemoryGate::Lease::grow(std::uint64_t bytes, std::chrono::milliseconds patience) {
  if (!room_) {
    return core::ok_status();
  }
  MemoryUse use;
  {
    const core::MutexLock lock(room_->mutex);
    use = room_->held.at(id_).use;
  }
  use.bytes += bytes;
  return room_->wait_to_set(id_, use, what_, patience);
}

void MemoryGate::Lease::shrink_to(std::uint64_t bytes) {
  if (!room_) {
    return;
  }
  const core::MutexLock lock(room_->mutex);
  Room::Held held = room_->held.at(id_);
  held.use.bytes = std::min(held.use.bytes, bytes);
  room_->set(id_, std::move(held));
}

core::Result<MemoryGate::Lease> MemoryGate::take(MemoryUse use, std::string_view what,
                                                 std::chrono::milliseconds patience) {
  Lease lease = note({}, Kind::kNeeded);
  if (auto taken = room_->wait_to_set(lease.id_, use, what, patience); !taken) {
    return taken.error();
  }
  lease.what_ = what;
  return lease;
}

Status MemoryGate::check(std::uint64_t bytes, std::string_view what) const {
  return room_->check(bytes, what);
}

MemoryGate::Lease MemoryGate::note(MemoryUse use, Kind kind) {
  const core::MutexLock lock(room_->mutex);
  const std::uint64_t id = ++room_->last_id;
  room_->set(id, Room::Held{.use = std::move(use), .kind = kind});
  return {room_, id};
}

MemoryGate::Fit MemoryGate::try_change(Lease& lease, const MemoryUse& use, std::uint64_t most) {
  return lease.room_->try_set(lease.id_, use, most);
}

bool MemoryGate::has_room(const Lease& lease, const MemoryUse& use, std::uint64_t most) const {
  const core::MutexLock lock(room_->mutex);
  return room_->is_within(room_->total_with(lease.id_, use).needed, most);
}

void MemoryGate::change(Lease& lease, const MemoryUse& use) {
  const core::MutexLock lock(lease.room_->mutex);
  lease.room_->set(lease.id_, Room::Held{.use = use});
}

std::uint64_t MemoryGate::bytes_max_of_first(std::uint64_t bytes) const {
  return room_->limit_of_all(bytes);
}

bool MemoryGate::drop_one_idle() { return room_->reclaim(); }

void MemoryGate::add_reclaimer(std::function<bool()> drop_one) {
  const core::MutexLock lock(room_->mutex);
  room_->reclaimers.push_back(std::move(drop_one));
}

std::uint64_t MemoryGate::used_bytes() const {
  const core::MutexLock lock(room_->mutex);
  return room_->total.all;
}

}  // namespace server
