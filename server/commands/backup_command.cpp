#include "server/commands/backup_command.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

#include <fcntl.h>

#include "api/flags/flags.h"
#include "server/commands/check_film.h"
#include "server/config/config.h"
#include "server/jobs/job_record.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/job_table.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;
using core::Status;
namespace fs = std::filesystem;

constexpr const char* kBackupText =
    "Copies a data directory while a server uses it. The copy is consistent: a snapshot of the "
    "records, with the files that they refer to. A rendering job resumes from the checkpoint in "
    "the copy. Verify the copy with `tessera check --data`.";

constexpr int kPage = 200;
/// A film is copied again if a checkpoint was written in the meantime; checkpoints are seconds
/// apart.
constexpr int kTries = 5;

/// Copies and syncs a file. Errors: those of file_error(); kNotFound when it is gone.
Status copy_file(const std::string& from, const std::string& to) {
  std::error_code code;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, code);
  if (code == std::errc::no_such_file_or_directory) {
    return Error{ErrorCode::kNotFound, "is gone", from};
  }
  if (code) {
    return file_error("cannot copy to " + to, from, code.value());
  }
  const auto file = open_file(to, O_RDWR);
  return file ? sync_file(file->get(), to) : Status(file.error());
}

/// Copies the files below `from` that do not exist below `to`. Files named by their hash never
/// change; if one is deleted in the meantime, no record needs it, or it was copied already.
Status copy_new_files(const fs::path& from, const fs::path& to) {
  std::error_code code;
  for (fs::recursive_directory_iterator entry(from, code), end; !code && entry != end;
       entry.increment(code)) {
    const fs::path target = to / fs::relative(entry->path(), from, code);
    std::error_code is_gone;
    if (!entry->is_regular_file(is_gone) || fs::exists(target, is_gone)) {
      continue;
    }
    if (const Status made = make_directories(target.parent_path().string()); !made) {
      return made;
    }
    const Status copied = copy_file(entry->path().string(), target.string());
    if (!copied && copied.error().code != ErrorCode::kNotFound) {
      return copied;
    }
  }
  return code ? Status(file_error("cannot read", from.string(), code.value())) : core::ok_status();
}

/// Films are written in place: a copy taken during a checkpoint is damaged, and is made again.
/// Returns its damage if that does not help: the copy is as the film is; empty: it is whole.
core::Result<std::string> copy_film(const JobRecord& record, const std::string& from,
                                    const std::string& to) {
  std::string damage;
  for (int i = 0; i < kTries; ++i) {
    if (const Status copied = copy_file(from, to); !copied) {
      return copied.error();
    }
    const Status whole = check_film(record, to);
    if (whole) {
      return std::string();
    }
    damage = whole.error().message;
  }
  return damage;
}

core::Result<BackedUp> copy_films(JobTable& jobs, const std::string& from, const DataDir& to) {
  BackedUp copied;
  JobQuery query;
  query.limit = kPage;
  for (bool more = true; more;) {
    const auto rows = jobs.list(query);
    if (!rows) {
      return rows.error();
    }
    for (const JobRow& row : *rows) {
      ++copied.jobs;
      query.before = row.sequence;
      auto record = to_record(row);
      if (!record || record->film == FilmPlace::kEvicted) {
        continue;  // The verb `check` reports unreadable records.
      }
      const std::string path = to.film_path(row.id);
      const auto damage = copy_film(*record, from + "/films/" + row.id + ".film", path);
      const bool is_gone = !damage && damage.error().code == ErrorCode::kNotFound;
      if (!damage && !is_gone) {
        return damage.error();
      }
      if (damage && !damage->empty()) {
        copied.damages.push_back("job " + row.id + ": " + *damage + "; it was copied as it is");
      }
      copied.films += is_gone ? 0 : 1;
      if (is_gone && record->film == FilmPlace::kOnDisk) {
        record->film = FilmPlace::kEvicted;  // Evicted or deleted since the snapshot.
        if (const Status noted = jobs.update(to_row(*record), {}); !noted) {
          return noted.error();
        }
      }
    }
    more = static_cast<int>(rows->size()) == kPage;
  }
  return copied;
}

}  // namespace

core::Result<BackedUp> back_up(const std::string& from, const std::string& to) {
  std::error_code code;
  if (!fs::exists(from + "/tessera.db", code)) {
    return Error{ErrorCode::kNotFound, "not a data directory", from};
  }
  if (fs::exists(to, code) && !fs::is_empty(to, code)) {
    return Error{ErrorCode::kConflict, "the directory is not empty", to};
  }
  const auto data = DataDir::open(to);
  if (!data) {
    return data.error();
  }
  // Copies files before the records that refer to them, then files added in the meantime.
  const auto copy_files = [&]() -> Status {
    for (const char* folder : {"/assets", "/comparisons"}) {
      if (const Status copied = copy_new_files(from + folder, to + folder); !copied) {
        return copied;
      }
    }
    return core::ok_status();
  };
  if (const Status copied = copy_files(); !copied) {
    return copied.error();
  }
  {
    auto source = Database::open(from + "/tessera.db");
    if (!source) {
      return source.error();
    }
    auto session = (*source)->session();
    Statement copy = session.prepare("VACUUM INTO ?");
    if (const Status copied = copy.bind(data->database_path()).run(); !copied) {
      return copied.error();
    }
  }
  if (const Status copied = copy_files(); !copied) {
    return copied.error();
  }
  for (const char* name : {"/webhook.secret", "/webhook.secret-mark"}) {
    if (const Status copied = copy_file(from + name, to + name);
        !copied && copied.error().code != ErrorCode::kNotFound) {
      return copied.error();
    }
  }
  auto database = Database::open(data->database_path());
  if (!database) {
    return database.error();
  }
  JobTable jobs(**database);
  auto copied = copy_films(jobs, from, *data);
  if (copied) {
    for (const std::string& folder : {data->path(), data->films_path()}) {
      if (const Status synced = sync_directory(folder); !synced) {
        return synced.error();
      }
    }
  }
  return copied;
}

int backup_command(const std::vector<std::string>& args) {
  std::string data;
  std::string to;
  CLI::App app(kBackupText, "tessera backup");
  app.add_option("--data", data,
                 "The data directory; a server of the same version may be using it.")
      ->type_name("DIR");
  app.add_option("--to", to, "Directory for the copy; must be empty or not exist.")
      ->type_name("DIR")
      ->required();
  return flags::parse_and_run(app, args, [&] {
    const auto from = data_directory(data);
    if (!from) {
      return flags::complain("tessera backup", from.error(), flags::kWrongUsage);
    }
    const auto copied = back_up(*from, to);
    if (!copied) {
      return flags::complain("tessera backup", copied.error(), flags::kFailed);
    }
    for (const std::string& damage : copied->damages) {
      std::fprintf(stderr, "tessera backup: %s\n", damage.c_str());
    }
    std::printf("%d jobs, %d films copied to %s\n", copied->jobs, copied->films, to.c_str());
    return flags::kDone;
  });
}

}  // namespace server
