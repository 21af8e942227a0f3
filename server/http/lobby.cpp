#include "server/http/lobby.h"

#include <cstddef>

#include <sys/socket.h>

namespace server {

void Lobby::enter(Guest& guest, const std::string& address) {
  const core::MutexLock lock(mutex_);
  if (guest.is_evicted_) {
    return;
  }
  guest.place_ = waiting_.insert(waiting_.end(), &guest);
  if (!address.empty()) {
    guest.address_ = address;
    std::list<Guest*>& neighbours = of_address_[address];
    guest.place_of_address_ = neighbours.insert(neighbours.end(), &guest);
    if (neighbours.size() > static_cast<std::size_t>(limits_.waiting_of_address)) {
      ++counts_.evicted_of_address;
      evict(*neighbours.front());
    }
  }
  if (waiting_.size() > static_cast<std::size_t>(limits_.waiting)) {
    ++counts_.evicted;
    evict(*waiting_.front());
  }
}

bool Lobby::leave(Guest& guest) {
  const core::MutexLock lock(mutex_);
  forget(guest);
  return !guest.is_evicted_;
}

void Lobby::remove(Guest& guest) {
  const core::MutexLock lock(mutex_);
  forget(guest);
  if (guest.is_evicted_) {
    --leaving_;
  }
}

bool Lobby::evict_oldest() {
  const core::MutexLock lock(mutex_);
  if (waiting_.empty()) {
    return false;
  }
  ++counts_.evicted;
  evict(*waiting_.front());
  return true;
}

int Lobby::leaving_count() const {
  const core::MutexLock lock(mutex_);
  return leaving_;
}

Lobby::Counts Lobby::counts() const {
  const core::MutexLock lock(mutex_);
  return counts_;
}

void Lobby::forget(Guest& guest) {
  if (guest.place_) {
    waiting_.erase(*guest.place_);
    guest.place_.reset();
  }
  if (guest.place_of_address_) {
    const auto found = of_address_.find(guest.address_);
    found->second.erase(*guest.place_of_address_);
    if (found->second.empty()) {
      of_address_.erase(found);
    }
    guest.place_of_address_.reset();
  }
}

/// Called with the mutex held, so that the descriptor still belongs to the guest. Data that the
/// client has already sent can still be read.
void Lobby::evict(Guest& guest) {
  forget(guest);
  guest.is_evicted_ = true;
  ++leaving_;
  ::shutdown(guest.fd_, SHUT_RD);
}

}  // namespace server
