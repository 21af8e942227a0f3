#include "server/commands/check_command.h"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/file.h>
#include <unistd.h>

#include "api/flags/flags.h"
#include "api/json/json.h"
#include "core/base/sha256.h"
#include "core/base/temporary_folder.h"
#include "core/film/film.h"
#include "server/commands/check_film.h"
#include "server/config/config.h"
#include "server/jobs/job_record.h"
#include "server/routes/first_image_file.h"
#include "server/store/comparison_store.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/job_table.h"
#include "server/store/scene_table.h"
#include "server/webhooks/webhook_secrets.h"

namespace server {
namespace {

constexpr const char* kCheckText =
    "Verifies a data directory: the pages and references of the database, the hash of every asset, "
    "the files of every scene, the checksums and digest of every film, the images stored beside "
    "it, the maps of every comparison, the hash of webhook.secret. Changes nothing without "
    "--repair; the directory may be read-only, such as a backup. Exit code 1 if something is "
    "damaged; orphaned files are reported but do not count as damage.";

constexpr int kCheckPage = 200;

struct Leftover {
  std::string words;
  std::filesystem::path path;
};

struct Findings {
  std::vector<std::string> damages;
  std::vector<Leftover> leftovers;
  int removed = 0;  ///< Leftovers moved to orphaned/.
  int jobs = 0;
  int films = 0;
  int scenes = 0;
  int assets = 0;
};

void check_pages(Database& database, Findings& findings) {
  auto session = database.session();
  for (const char* pragma : {"PRAGMA integrity_check(20)", "PRAGMA foreign_key_check"}) {
    Statement check = session.prepare(pragma);
    while (check.step()) {
      if (const std::string told = check.text(0); told != "ok") {
        findings.damages.push_back("database: " + told);
      }
    }
    if (const auto status = check.status(); !status) {
      findings.damages.push_back("database: " + status.error().message);
    }
  }
}

/// Returns empty if the file cannot be read.
std::optional<std::string> hash_of_file(const std::string& path) {
  const auto fd = open_file(path, O_RDONLY);
  if (!fd) {
    return std::nullopt;
  }
  core::Sha256 hash;
  std::vector<std::byte> piece(1U << 20U);
  for (std::uint64_t offset = 0;;) {
    const auto got = read_at(fd->get(), piece, offset, path);
    if (!got) {
      return std::nullopt;
    }
    if (*got == 0) {
      return hash.hex();
    }
    hash.add(piece.data(), *got);
    offset += *got;
  }
}

std::vector<std::string> column(Database& database, const char* sql, Findings& findings) {
  auto session = database.session();
  Statement select = session.prepare(sql);
  std::vector<std::string> values;
  while (select.step()) {
    values.push_back(select.text(0));
  }
  if (const auto status = select.status(); !status) {
    findings.damages.push_back("database: " + status.error().message);
  }
  return values;
}

void check_assets(Database& database, const DataDir& data, Findings& findings) {
  std::set<std::string> known;
  for (const std::string& id : column(database, "SELECT id FROM assets", findings)) {
    ++findings.assets;
    known.insert(id);
    const auto hash = hash_of_file(data.assets_path() + "/" + id.substr(0, 2) + "/" + id);
    if (!hash || *hash != id) {
      findings.damages.push_back(
          "asset " + id + ": " +
          (hash ? "its content does not match its hash" : "its file is gone"));
    }
  }
  for (const std::string& id :
       column(database, "SELECT DISTINCT asset FROM scene_files", findings)) {
    if (known.count(id) == 0) {
      findings.damages.push_back("asset " + id + ": a scene refers to it, but it has no record");
    }
  }
  findings.scenes = static_cast<int>(column(database, "SELECT id FROM scenes", findings).size());
  std::error_code code;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(data.assets_path(), code)) {
    if (entry.is_regular_file(code) && known.count(entry.path().filename().string()) == 0) {
      findings.leftovers.push_back(
          {"asset file " + entry.path().filename().string(), entry.path()});
    }
  }
}

void check_film_of(const JobRow& row, const DataDir& data, Findings& findings) {
  const auto record = to_record(row);
  if (!record) {
    findings.damages.push_back("job " + row.id + ": " + record.error().message);
    return;
  }
  const std::string path = data.film_path(row.id);
  const bool is_finished =
      record->view.state == api::JobState::kFinished && record->film == FilmPlace::kOnDisk;
  std::error_code code;
  if (!std::filesystem::exists(path, code)) {
    if (is_finished) {
      findings.damages.push_back("job " + row.id + ": its film is gone");
    }
    return;
  }
  ++findings.films;
  if (const core::Status whole = check_film(*record, path); !whole) {
    findings.damages.push_back("job " + row.id + ": " + whole.error().message);
  }
}

void check_first_images_of(const std::string& job, const DataDir& data, Findings& findings) {
  const core::Status whole = check_first_images(data.first_images_path(job));
  if (!whole && whole.error().code != core::ErrorCode::kNotFound) {
    findings.damages.push_back("looks/" + job + ": " + whole.error().message +
                               "; remove it, and its images are made from the film");
  }
}

/// Adds the entries of the folder that have no record. known: names of those that have.
void find_leftovers(const std::string& folder, const std::set<std::string>& known,
                    const std::string& words, Findings& findings) {
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    const std::string name = entry.path().filename().string();
    if (known.count(name) == 0) {
      findings.leftovers.push_back({words + name, entry.path()});
    }
  }
}

void check_jobs(Database& database, const DataDir& data, Findings& findings) {
  JobTable table(database);
  std::set<std::string> films;
  std::set<std::string> first_images;
  JobQuery query;
  query.limit = kCheckPage;
  while (true) {
    const auto rows = table.list(query);
    if (!rows) {
      findings.damages.push_back("database: " + rows.error().message);
      return;
    }
    for (const JobRow& row : *rows) {
      ++findings.jobs;
      films.insert(row.id + ".film");
      first_images.insert(row.id);
      check_film_of(row, data, findings);
      check_first_images_of(row.id, data, findings);
      query.before = row.sequence;
    }
    if (static_cast<int>(rows->size()) < kCheckPage) {
      break;
    }
  }
  find_leftovers(data.films_path(), films, "film file ", findings);
  find_leftovers(data.first_images_path(), first_images, "look file ", findings);
}

void check_comparisons(Database& database, const DataDir& data, Findings& findings) {
  const ComparisonStore store(database, data, {});
  std::set<std::string> known;
  std::error_code code;
  for (const std::string& id : column(database, "SELECT id FROM comparisons", findings)) {
    known.insert(id);
    const std::string folder = data.comparisons_path() + "/" + id;
    if (!std::filesystem::exists(folder, code)) {
      findings.damages.push_back("comparison " + id + ": its maps are gone");
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
      const std::string name = entry.path().filename().string();
      if (const auto map = store.open_map(id, name); !map) {
        findings.damages.push_back("comparison " + id + ", " + name + ": " + map.error().message);
      }
    }
  }
  find_leftovers(data.comparisons_path(), known, "comparison ", findings);
}

/// Moves files to which no record refers to the folder orphaned/, since the record may be what was
/// lost. Moves nothing if a record is damaged: the files that it refers to are unknown.
void repair(const DataDir& data, Findings& findings) {
  if (!findings.damages.empty() || findings.leftovers.empty()) {
    return;
  }
  const std::filesystem::path folder = std::filesystem::path(data.path()) / "orphaned";
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  for (const Leftover& leftover : findings.leftovers) {
    if (!code) {
      std::filesystem::rename(leftover.path, folder / leftover.path.filename(), code);
    }
    if (code) {
      findings.damages.push_back(leftover.words + ": cannot be moved to " + folder.string() + ": " +
                                 code.message());
    } else {
      ++findings.removed;
    }
  }
}

void print(const Findings& findings, bool as_json) {
  if (as_json) {
    std::vector<std::string> leftovers;
    for (const Leftover& leftover : findings.leftovers) {
      leftovers.push_back(leftover.words);
    }
    std::printf("%s\n", api::dump({{"damages", findings.damages},
                                   {"leftovers", leftovers},
                                   {"removed", findings.removed},
                                   {"jobs", findings.jobs},
                                   {"films", findings.films},
                                   {"scenes", findings.scenes},
                                   {"assets", findings.assets}})
                            .c_str());
    return;
  }
  for (const std::string& damage : findings.damages) {
    std::printf("damaged: %s\n", damage.c_str());
  }
  for (const Leftover& leftover : findings.leftovers) {
    std::printf("left over: %s\n", leftover.words.c_str());
  }
  std::printf(
      "%d jobs, %d films, %d scenes, %d assets: %zu damaged, %zu left over, %d moved to "
      "orphaned/\n",
      findings.jobs, findings.films, findings.scenes, findings.assets, findings.damages.size(),
      findings.leftovers.size(), findings.removed);
}

/// Makes `copy` a data directory with a copy of the database, which SQLite cannot read without
/// writing beside it, and links to the other files.
core::Status mirror(const std::string& directory, const std::string& copy) {
  namespace fs = std::filesystem;
  std::error_code code;
  const auto lock = open_file(directory + "/lock", O_RDONLY);
  if (lock && ::flock(lock->get(), LOCK_SH | LOCK_NB) != 0) {
    return core::Error{core::ErrorCode::kConflict, "a server uses it; stop the server first",
                       directory};
  }
  for (const char* end : {"", "-wal", "-mark", "-damage"}) {
    const std::string name = std::string("/tessera.db") + end;
    if (!code && fs::exists(directory + name, code)) {
      fs::copy_file(directory + name, copy + name, code);
      if (!code) {
        fs::permissions(copy + name, fs::perms::owner_read | fs::perms::owner_write, code);
      }
    }
  }
  for (const char* folder : {"/assets", "/films", "/looks", "/comparisons"}) {
    if (!code && fs::exists(directory + folder, code)) {
      fs::create_directory_symlink(fs::absolute(directory + folder), copy + folder, code);
    }
  }
  return code ? core::Status(file_error("cannot be copied to " + copy, directory, code.value()))
              : core::ok_status();
}

int check(const std::string& data_dir, bool with_repair, bool as_json) {
  const auto directory = data_directory(data_dir);
  if (!directory) {
    return flags::complain("tessera check", directory.error(), flags::kWrongUsage);
  }
  std::error_code code;
  if (!std::filesystem::exists(*directory + "/tessera.db", code)) {
    return flags::complain("tessera check",
                           {core::ErrorCode::kNotFound, "not a data directory", *directory},
                           flags::kFailed);
  }
  const bool is_read_only = ::access(directory->c_str(), W_OK) != 0;
  if (is_read_only && with_repair) {
    return flags::complain(
        "tessera check",
        {core::ErrorCode::kConflict, "is read-only, so it cannot be repaired", *directory},
        flags::kFailed);
  }
  std::optional<core::TemporaryFolder> copy;
  if (is_read_only) {
    copy.emplace();
    if (const core::Status made = mirror(*directory, copy->path()); !made) {
      return flags::complain("tessera check", made.error(), flags::kFailed);
    }
  }
  const auto data = DataDir::open(copy ? copy->path() : *directory);
  if (!data) {
    return flags::complain("tessera check", data.error(), flags::kFailed);
  }
  auto database = Database::open(data->database_path());
  if (!database) {
    return flags::complain("tessera check", database.error(), flags::kFailed);
  }
  Findings findings;
  if (const std::string& damage = (*database)->damage(); !damage.empty()) {
    findings.damages.push_back("database: " + damage.substr(0, damage.find_last_not_of('\n') + 1) +
                               " Remove " + data->database_path() +
                               "-damage to accept this; tessera.db-wal-damaged, if it is there, is "
                               "a copy of the log.");
  }
  check_pages(**database, findings);
  check_assets(**database, *data, findings);
  check_jobs(**database, *data, findings);
  check_comparisons(**database, *data, findings);
  if (const auto secret = read_webhook_secret(*directory); !secret) {
    findings.damages.push_back("webhook.secret: " + secret.error().message);
  }
  if (with_repair) {
    repair(*data, findings);
  }
  print(findings, as_json);
  return findings.damages.empty() ? flags::kDone : flags::kFailed;
}

}  // namespace

int check_command(const std::vector<std::string>& args) {
  std::string data;
  bool as_json = false;
  bool with_repair = false;
  CLI::App app(kCheckText, "tessera check");
  app.add_option("--data", data, "The data directory; stop the server first.")->type_name("DIR");
  app.add_flag("--json", as_json, "Print the findings as JSON.");
  app.add_flag("--repair", with_repair,
               "Move orphaned files, to which no record refers, to the folder orphaned/.");
  return flags::parse_and_run(app, args, [&] { return check(data, with_repair, as_json); });
}

}  // namespace server
