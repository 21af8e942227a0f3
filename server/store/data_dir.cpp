#include "server/store/data_dir.h"

#include <cerrno>
#include <span>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace server {

core::Result<DataDir> DataDir::open(const std::string& path) {
  for (const std::string& folder :
       {path, path + "/assets", path + "/films", path + "/looks", path + "/comparisons"}) {
    if (const auto made = make_directories(folder); !made) {
      return made.error();
    }
  }
  const std::string lock_path = path + "/lock";
  auto lock = open_file(lock_path, O_RDWR | O_CREAT);
  if (!lock) {
    return lock.error();
  }
  if (::flock(lock->get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) {
      return file_error("cannot lock", lock_path, errno);
    }
    std::string owner(32, '\0');
    const auto got = read_at(lock->get(), std::as_writable_bytes(std::span(owner)), 0, lock_path);
    owner.resize(got ? *got : 0);
    return core::Error{core::ErrorCode::kConflict,
                       "data directory already in use by process " + owner +
                           "; stop that server, or choose another directory with --data",
                       path};
  }
  const std::string me = std::to_string(::getpid());
  if (::ftruncate(lock->get(), 0) == 0) {
    // Used only by the message above; the lock holds without it.
    static_cast<void>(write_at(lock->get(), std::as_bytes(std::span(me)), 0, lock_path));
  }
  return DataDir(path, std::move(*lock));
}

}  // namespace server
