/// Lobby: connections that wait for a complete request head; selects those to close when there are
/// too many.
///
/// Any client can open connections, and nothing is known about it before its first head is
/// complete. A client that sends its head at once stays here only for a moment; one that sends it
/// slowly, or not at all, remains. Closing the oldest therefore makes a flood of slow clients close
/// its own connections, while a request that arrives in one piece is always served.
#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/base/mutex.h"

namespace server {

class Lobby {
 public:
  struct Limits {
    int waiting = 0;             ///< In total, at least 1.
    int waiting_of_address = 0;  ///< For one address group, at least 1.
  };
  explicit Lobby(Limits limits) : limits_(limits) {}
  Lobby(const Lobby&) = delete;
  Lobby& operator=(const Lobby&) = delete;

  /// One connection. The descriptor must stay open as long as this object exists.
  class Guest {
   public:
    Guest(Lobby& lobby, int fd) : lobby_(lobby), fd_(fd) {}
    ~Guest() { lobby_.remove(*this); }
    Guest(const Guest&) = delete;
    Guest& operator=(const Guest&) = delete;

    /// Starts waiting; from now on it may be evicted. address: from address_group(); empty for a
    /// known client, which only the total limit binds.
    void enter(const std::string& address) { lobby_.enter(*this, address); }
    /// Stops waiting. Returns false when it was evicted and its reading side is shut.
    bool leave() { return lobby_.leave(*this); }

   private:
    friend class Lobby;
    Lobby& lobby_;
    const int fd_;
    // Guarded by the lobby's mutex, like all members below.
    bool is_evicted_ = false;
    std::string address_;
    std::optional<std::list<Guest*>::iterator> place_;             ///< In waiting_, while it waits.
    std::optional<std::list<Guest*>::iterator> place_of_address_;  ///< In its address's list.
  };

  /// Evicts the connection that has waited longest. Returns false when none waits.
  bool evict_oldest() EXCLUDES(mutex_);
  /// Number of evicted guests that have not left yet.
  int leaving_count() const EXCLUDES(mutex_);

  struct Counts {
    std::uint64_t evicted_of_address = 0;  ///< Because their address had too many.
    std::uint64_t evicted = 0;             ///< Because there were too many in total.
  };
  Counts counts() const EXCLUDES(mutex_);

 private:
  void enter(Guest& guest, const std::string& address) EXCLUDES(mutex_);
  bool leave(Guest& guest) EXCLUDES(mutex_);
  void remove(Guest& guest) EXCLUDES(mutex_);
  void forget(Guest& guest) REQUIRES(mutex_);
  void evict(Guest& guest) REQUIRES(mutex_);

  const Limits limits_;
  mutable core::Mutex mutex_;
  std::list<Guest*> waiting_ GUARDED_BY(mutex_);  ///< Oldest first.
  std::unordered_map<std::string, std::list<Guest*>> of_address_ GUARDED_BY(mutex_);
  int leaving_ GUARDED_BY(mutex_) = 0;
  Counts counts_ GUARDED_BY(mutex_);
};

}  // namespace server
