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
#include <zlib.h>

#include "core/base/byte_order.h"
#include "core/image_io/image_size.h"

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
class StorageUse {
 public:
  /// Pre: called with the oldest first.
  void add(std::string id, std::int64_t bytes, const std::string& tenant) {
    Owned& owned = of_tenant_[tenant];
    owned.oldest_first.push_back({std::move(id), bytes, ++last_});
    owned.bytes += bytes;
    bytes_ += bytes;
    ++count_;
  }
  std::int64_t count() const { return count_; }
  std::int64_t bytes() const { return bytes_; }

  /// Takes the oldest of the tenant with the most bytes among those that have several; if all have
  /// one, the oldest. Pre: count() > 0.
  std::string take_oldest_of_largest() {
    const auto size = [](const auto& item) {
      const Owned& owned = item.second;
      const bool has_several = owned.oldest_first.size() > 1;
      return std::tuple(has_several, has_several ? owned.bytes : 0,
                        -owned.oldest_first.front().number);
    };
    const auto largest =
        std::max_element(of_tenant_.begin(), of_tenant_.end(),
                         [&](const auto& a, const auto& b) { return size(a) < size(b); });
    Owned& owned = largest->second;
    Item oldest = std::move(owned.oldest_first.front());
    owned.oldest_first.pop_front();
    owned.bytes -= oldest.bytes;
    bytes_ -= oldest.bytes;
    --count_;
    if (owned.oldest_first.empty()) {
      of_tenant_.erase(largest);
    }
    return oldest.id;
  }

 private:
  struct Item {
    std::string id;
    std::int64_t bytes = 0;
    std::int64_t number = 0;  ///< In the order of their age.
  };
  struct Owned {
    std::deque<Item> oldest_first;
    std::int64_t bytes = 0;
  };
  std::map<std::string, Owned> of_tenant_;
  std::int64_t bytes_ = 0;
  std::int64_t count_ = 0;
  std::int64_t last_ = 0;
};

/// Returns whether the file is a PNG whose chunks all match their checksums. Source: PNG, 3rd
/// edition, 5.3: length, type, data, and the CRC-32 of type and data.
bool is_whole_png(int fd, const std::string& path) {
  std::vector<std::byte> piece(std::size_t{1} << 16U);
  std::uint64_t at = 0;
  const auto read = [&](std::size_t bytes) {
    const auto got = read_at(fd, std::span(piece).first(bytes), at, path);
    at += bytes;
    return got && *got == bytes;
  };
  const auto sum = [&piece](std::uint32_t before, std::size_t offset, std::size_t bytes) {
    return static_cast<std::uint32_t>(
        ::crc32_z(before, reinterpret_cast<const Bytef*>(piece.data() + offset), bytes));
  };
  if (!read(8) || core::image_kind(std::span(piece).first(8)) != "png") {
    return false;
  }
  constexpr std::uint32_t kEnd = 0x49454E44;  // IEND
  for (std::uint32_t type = 0; type != kEnd;) {
    if (!read(8)) {
      return false;
    }
    type = core::u32_big(piece, 4);
    std::uint32_t crc = sum(0, 4, 4);
    for (std::size_t left = core::u32_big(piece, 0); left > 0;) {
      const std::size_t bytes = std::min(left, piece.size());
      if (!read(bytes)) {
        return false;
      }
      crc = sum(crc, 0, bytes);
      left -= bytes;
    }
    if (!read(4) || core::u32_big(piece, 0) != crc) {
      return false;
    }
  }
  const auto bytes = file_bytes(fd, path);
  return bytes && *bytes == at;
}

}  // namespace

core::Result<UniqueFd> ComparisonStore::open_map(std::string_view id, std::string_view map) const {
  const std::string path = path_of(id, map);
  auto fd = open_file(path, O_RDONLY);
  if (!fd || !is_whole_png(fd->get(), path)) {
    return Error{ErrorCode::kInternal,
                 "the stored map is " + std::string(fd ? "damaged" : "gone") + "; compare again",
                 ""};
  }
  return fd;
}

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
  std::vector<std::string> old;
  Status stored = write_maps(row.id, maps);
  if (stored) {
    const auto work = [&](Database::Session& session) -> Status {
      {
        Statement statement = session.prepare(
            "INSERT INTO comparisons(id, body, bytes, created_at, tenant) VALUES(?,?,?,?,?)");
        statement.bind(row.id).bind(row.body).bind(bytes).bind(row.created_at);
        if (auto inserted = statement.bind(row.tenant).run(); !inserted) {
          return inserted;
        }
      }
      return forget_oldest(session, old);
    };
    stored = database_.transact(work, Database::Spend::kFreeSpace);
  }
  if (!stored) {
    old = {row.id};
  }
  for (const std::string& id : old) {
    remove_maps(id);
  }
  return stored;
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

Status ComparisonStore::forget_oldest(Database::Session& session, std::vector<std::string>& old) {
  old.clear();
  {
    Statement select =
        session.prepare("SELECT id, bytes, tenant FROM comparisons ORDER BY sequence");
    StorageUse use;
    while (select.step()) {
      use.add(select.text(0), select.integer(1), select.text(2));
    }
    if (auto status = select.status(); !status) {
      return status;
    }
    while (use.count() > limits_.count || (use.count() > 1 && use.bytes() > limits_.bytes)) {
      old.push_back(use.take_oldest_of_largest());
    }
  }
  for (const std::string& id : old) {
    if (auto gone = session.prepare("DELETE FROM comparisons WHERE id=?").bind(id).run(); !gone) {
      return gone;
    }
  }
  return core::ok_status();
}

}  // namespace server
