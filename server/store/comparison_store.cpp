#include "server/store/comparison_store.h"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <fcntl.h>

#include "server/store/files.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

Status write_whole(const std::string& path, std::string_view content) {
  const auto fd = open_file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (!fd) {
    return fd.error();
  }
  if (auto written = write_at(fd->get(), std::as_bytes(std::span(content)), 0, path); !written) {
    return written;
  }
  return sync_file(fd->get(), path);
}

/// The stored comparisons of each tenant.
class Kept {
 public:
  /// Pre: called with the oldest first.
  void add(std::string id, std::int64_t bytes, const std::string& tenant) {
    Owned& owned = of_tenant_[tenant];
    owned.oldest_first.emplace_back(std::move(id), bytes);
    owned.bytes += bytes;
    bytes_ += bytes;
    ++count_;
  }
  std::int64_t count() const { return count_; }
  std::int64_t bytes() const { return bytes_; }

  /// Takes the oldest of the tenant with the most bytes, of several the one with the most
  /// comparisons; never the only one of a tenant unless all tenants have one. Pre: count() > 0.
  std::string take_oldest_of_largest() {
    const auto size = [](const auto& item) {
      const Owned& owned = item.second;
      return std::tuple(owned.oldest_first.size() > 1, owned.bytes, owned.oldest_first.size());
    };
    const auto largest =
        std::max_element(of_tenant_.begin(), of_tenant_.end(),
                         [&](const auto& a, const auto& b) { return size(a) < size(b); });
    Owned& owned = largest->second;
    auto [id, bytes] = std::move(owned.oldest_first.front());
    owned.oldest_first.pop_front();
    owned.bytes -= bytes;
    bytes_ -= bytes;
    --count_;
    if (owned.oldest_first.empty()) {
      of_tenant_.erase(largest);
    }
    return id;
  }

 private:
  struct Owned {
    std::deque<std::pair<std::string, std::int64_t>> oldest_first;
    std::int64_t bytes = 0;
  };
  std::map<std::string, Owned> of_tenant_;
  std::int64_t bytes_ = 0;
  std::int64_t count_ = 0;
};

}  // namespace

std::string ComparisonStore::path_of(std::string_view id, std::string_view map) const {
  return data_.comparisons_path() + "/" + std::string(id) + "/" + std::string(map);
}

Status ComparisonStore::write_maps(const std::string& id, const ComparisonMaps& maps) const {
  const std::string folder = data_.comparisons_path() + "/" + id;
  if (auto made = make_directories(folder); !made) {
    return made;
  }
  for (const auto& [name, content] : maps) {
    if (auto written = write_whole(path_of(id, name), content); !written) {
      return written;
    }
  }
  if (auto synced = sync_directory(folder); !synced) {
    return synced;
  }
  return sync_directory(data_.comparisons_path());
}

void ComparisonStore::remove_maps(const std::string& id) const {
  std::error_code problem;  // A folder that remains only costs disk space.
  std::filesystem::remove_all(data_.comparisons_path() + "/" + id, problem);
}

Status ComparisonStore::insert(const Row& row, const ComparisonMaps& maps) {
  std::int64_t bytes = 0;
  for (const auto& [name, content] : maps) {
    bytes += static_cast<std::int64_t>(content.size());
  }
  Status stored = write_maps(row.id, maps);
  if (stored) {
    const auto work = [&](Database::Session& session) -> Status {
      Statement statement = session.prepare(
          "INSERT INTO comparisons(id, body, bytes, created_at, tenant) VALUES(?,?,?,?,?)");
      statement.bind(row.id).bind(row.body).bind(bytes).bind(row.created_at);
      return statement.bind(row.tenant).run();
    };
    stored = database_.transact(work, Database::Spend::kFreeSpace);
  }
  if (!stored) {
    remove_maps(row.id);
    return stored;
  }
  return forget_oldest();
}

core::Result<std::string> ComparisonStore::find(std::string_view id, const Access& access) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT body, tenant FROM comparisons WHERE id=?");
  select.bind(id);
  std::string body;
  const bool found = select.step();
  const bool is_seen = found && access.sees(select.text(1));
  if (is_seen) {
    body = select.text(0);
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  if (!is_seen) {
    return Error{ErrorCode::kNotFound, "no comparison has the id \"" + std::string(id) + "\"", ""};
  }
  return body;
}

Status ComparisonStore::forget_oldest() {
  std::vector<std::string> old;
  const Status forgotten = database_.transact([&](Database::Session& session) -> Status {
    {
      Statement select =
          session.prepare("SELECT id, bytes, tenant FROM comparisons ORDER BY sequence");
      Kept kept;
      while (select.step()) {
        kept.add(select.text(0), select.integer(1), select.text(2));
      }
      if (auto status = select.status(); !status) {
        return status;
      }
      while (kept.count() > limits_.count || (kept.count() > 1 && kept.bytes() > limits_.bytes)) {
        old.push_back(kept.take_oldest_of_largest());
      }
    }
    for (const std::string& id : old) {
      if (auto gone = session.prepare("DELETE FROM comparisons WHERE id=?").bind(id).run(); !gone) {
        return gone;
      }
    }
    return core::ok_status();
  });
  if (forgotten) {
    for (const std::string& id : old) {
      remove_maps(id);
    }
  }
  return forgotten;
}

}  // namespace server
