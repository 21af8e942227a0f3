#include "server/store/comparison_store.h"

#include <filesystem>
#include <span>
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
          session.prepare("SELECT id, bytes FROM comparisons ORDER BY sequence DESC");
      std::int64_t count = 0;
      std::int64_t bytes = 0;
      while (select.step()) {
        ++count;
        bytes += select.integer(1);
        if (count > limits_.count || (count > 1 && bytes > limits_.bytes)) {
          old.push_back(select.text(0));
        }
      }
      if (auto status = select.status(); !status) {
        return status;
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
