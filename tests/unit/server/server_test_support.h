/// Helpers shared by the tests of the server: a temporary folder, bytes, small films.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/check.h"
#include "core/base/temporary_folder.h"
#include "core/film/film.h"

namespace test_support {

class TemporaryFolder : public core::TemporaryFolder {
 public:
  TemporaryFolder() { CHECK(!path().empty()); }
  std::string file(std::string_view name) const { return path() + "/" + std::string(name); }
};

std::string read_file(const std::string& path);
void write_file(const std::string& path, std::string_view content);
/// Flips one bit of the file.
void damage_file(const std::string& path, std::uint64_t offset);

/// 70 x 40 pixels (3 x 2 tiles), with auxiliary layers.
core::FilmSettings small_film();
/// A tile in which every value is a function of (tile, samples).
core::TileState made_tile(const core::Film& film, int tile, int samples);

/// A glTF document of one triangle whose buffer is the file `uri`; the buffer's content.
std::string triangle_gltf(std::string_view uri);
std::string triangle_buffer();

/// Reverts the jobs of a store to the schema with a column for each member. Of those that are not
/// columns today, keeps spec, stop_reason and samples_mean.
inline constexpr const char* kBackToSchema15 = R"sql(
DROP TABLE presets; DROP TABLE signing_keys; DROP TABLE suspended_workers;
ALTER TABLE jobs ADD COLUMN spec_version INTEGER NOT NULL DEFAULT 1;
ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN created_at REAL NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN started_at REAL;
ALTER TABLE jobs ADD COLUMN warnings TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN failure_code INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN failure_message TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN failure_where TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN film_digest TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN revision INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN fraction REAL NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN samples_min INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN samples_max INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN elapsed_seconds REAL NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN rays INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN rejected_samples INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN peak_bytes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN error_grain REAL;
ALTER TABLE jobs ADD COLUMN error_doubt REAL;
ALTER TABLE jobs ADD COLUMN error_reach REAL;
ALTER TABLE jobs ADD COLUMN build TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN ledger TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN samples_by_error INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN split_count INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN pause_reason TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN light_not_found TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN spec TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN stop_reason TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN samples_mean REAL NOT NULL DEFAULT 0;
UPDATE jobs SET spec=json_extract(record, '$.spec'),
  stop_reason=json_extract(record, '$.stop_reason'),
  samples_mean=json_extract(record, '$.samples_mean');
ALTER TABLE jobs DROP COLUMN record;
ALTER TABLE jobs DROP COLUMN record_crc;
PRAGMA user_version=15;
)sql";

/// The same from there to the schema before there were tenants.
inline constexpr const char* kBackToSchema7 = R"sql(
ALTER TABLE jobs DROP COLUMN light_not_found;
DROP TABLE batch_jobs; DROP TABLE batches;
DROP INDEX jobs_by_end; ALTER TABLE jobs DROP COLUMN pause_reason;
DROP TABLE sessions; DROP TABLE webhook_deliveries; DROP TABLE webhook_secrets;
CREATE TABLE deliveries(id TEXT PRIMARY KEY, job TEXT NOT NULL,
url TEXT NOT NULL, body TEXT NOT NULL,
  attempts INTEGER NOT NULL, next_at REAL NOT NULL) WITHOUT ROWID;
DROP TRIGGER keep_deleted_work; DROP TABLE deleted_work;
DROP TABLE scene_tenants; DROP TABLE asset_tenants;
ALTER TABLE keys DROP COLUMN tenant; ALTER TABLE keys DROP COLUMN priority_max;
ALTER TABLE comparisons DROP COLUMN tenant;
ALTER TABLE assets ADD COLUMN uploaded INTEGER NOT NULL DEFAULT 0;
ALTER TABLE assets ADD COLUMN owner TEXT NOT NULL DEFAULT '';
CREATE INDEX assets_by_owner ON assets(owner, bytes);
ALTER TABLE scenes ADD COLUMN description TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs RENAME COLUMN error_grain TO error_rmse;
ALTER TABLE jobs RENAME COLUMN error_doubt TO error_low;
ALTER TABLE jobs RENAME COLUMN error_reach TO error_high;
ALTER TABLE jobs ADD COLUMN error_unreliable INTEGER NOT NULL DEFAULT 0;
PRAGMA user_version=7;
)sql";

}  // namespace test_support
