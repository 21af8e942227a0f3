/// ComparisonStore: results of comparisons: figures in the database, maps as files.
///
/// When there are too many, or their maps take too much space, the oldest of the tenant with the
/// most space are removed.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/files.h"

namespace server {

/// File name of a map ("z.png") to its content.
using ComparisonMaps = std::map<std::string, std::string>;

struct ComparisonLimits {
  std::int64_t count = 1000;
  std::int64_t bytes = std::int64_t{1}
                       << 30;  ///< Limit for all maps; the newest comparison is always kept.
};

class ComparisonStore {
 public:
  /// Both must outlive this.
  ComparisonStore(Database& database, const DataDir& data, ComparisonLimits limits)
      : database_(database), data_(data), limits_(limits) {}

  struct Row {
    std::string id;
    std::string body;    ///< JSON
    std::string tenant;  ///< The owner.
    double created_at = 0;
  };
  /// Writes the maps to the disk before the record. Errors: kNoSpace, kInternal.
  core::Status insert(const Row& row, const ComparisonMaps& maps);
  /// Returns the JSON text. Errors: kNotFound, also for a comparison that `access` does not see.
  core::Result<std::string> find(std::string_view id, const Access& access);
  /// Returns the path that a map has or would have. Pre: the id is a UUID, the name one passed to
  /// insert().
  std::string path_of(std::string_view id, std::string_view map) const;
  /// Opens a map, a PNG whose own checksums are verified. Errors: kInternal when it is gone or
  /// damaged. Pre: as path_of().
  core::Result<UniqueFd> open_map(std::string_view id, std::string_view map) const;

 private:
  core::Status write_maps(const std::string& id, const ComparisonMaps& maps) const;
  void remove_maps(const std::string& id) const;
  /// Also returns the ids of comparisons whose maps are to be removed once this is committed.
  core::Status forget_oldest(Database::Session& session, std::vector<std::string>& old);

  Database& database_;
  const DataDir& data_;
  const ComparisonLimits limits_;
};

}  // namespace server
