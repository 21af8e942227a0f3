#include "server/commands/check_film.h"

#include "core/film/film.h"
#include "server/store/film_file.h"

namespace server {

core::Status check_film(const JobRecord& record, const std::string& path) {
  const auto film = blank_film(record.view);
  auto file = FilmFile::open(path);
  if (!file) {
    return file.error();
  }
  if (const auto restored = file->restore(*film); !restored) {
    return restored.error();
  }
  const bool is_finished =
      record.view.state == api::JobState::kFinished && record.film == FilmPlace::kOnDisk;
  return is_finished && film->digest() != record.view.film_digest
             ? core::Error{core::ErrorCode::kInternal, "its film does not match its digest", ""}
             : core::ok_status();
}

}  // namespace server
