#include "server/auth/tickets.h"

#include <algorithm>
#include <utility>

#include "server/store/key_table.h"

namespace server {

std::optional<std::string> Tickets::issue(std::vector<std::string> jobs, Holder holder,
                                          Clock::time_point now) {
  std::string ticket = random_hex(24);
  const core::MutexLock lock(mutex_);
  std::erase_if(entries_, [now](const auto& entry) { return entry.second.ends <= now; });
  const auto of_tenant = std::count_if(entries_.begin(), entries_.end(), [&](const auto& entry) {
    return entry.second.holder.access.tenant == holder.access.tenant;
  });
  const bool has_its_share =
      !holder.access.tenant.empty() && static_cast<std::size_t>(of_tenant) >= kMaxOfTenant;
  if (entries_.size() >= kMax || has_its_share) {
    return std::nullopt;
  }
  entries_.emplace(
      ticket, Entry{.jobs = std::move(jobs), .holder = std::move(holder), .ends = now + kLife});
  return ticket;
}

std::optional<Tickets::Holder> Tickets::holder_of(std::string_view ticket,
                                                  const std::vector<std::string>& jobs,
                                                  Clock::time_point now) const {
  const core::MutexLock lock(mutex_);
  const auto found = entries_.find(ticket);
  if (found == entries_.end() || found->second.ends <= now || jobs.empty()) {
    return std::nullopt;
  }
  const std::vector<std::string>& allowed = found->second.jobs;
  const bool all = std::all_of(jobs.begin(), jobs.end(), [&](const std::string& job) {
    return std::find(allowed.begin(), allowed.end(), job) != allowed.end();
  });
  return all ? std::optional<Holder>(found->second.holder) : std::nullopt;
}

}  // namespace server
