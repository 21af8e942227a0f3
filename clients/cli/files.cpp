#include "clients/cli/files.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include <unistd.h>

#include "core/base/file_names.h"
#include "core/base/text.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;
namespace fs = std::filesystem;

std::string reason() { return std::error_code(errno, std::generic_category()).message(); }

std::vector<std::string> entries_of(const fs::path& folder) {
  std::vector<std::string> out;
  std::error_code problem;
  for (fs::directory_iterator at(folder, problem); !problem && at != fs::directory_iterator();
       at.increment(problem)) {
    out.push_back(at->path().filename().string());
  }
  return out;
}

core::FileNames names_of(const std::vector<std::string>& all) {
  core::FileNames names;
  std::for_each(all.begin(), all.end(), [&names](const std::string& name) { names.add(name); });
  return names;
}

/// Returns the file or folder of a name in a folder: the same, else the only one that Windows and
/// macOS would take for it.
std::optional<fs::path> entry_in(const fs::path& folder, const std::string& name) {
  std::error_code problem;
  if (fs::exists(folder / name, problem)) {
    return folder / name;
  }
  const std::vector<std::string> all = entries_of(folder);
  const auto found = names_of(all).find(name);
  return found ? std::optional(folder / all[*found]) : std::nullopt;
}

std::optional<fs::path> find_inside(const fs::path& folder, const fs::path& relative) {
  fs::path place = folder;
  for (const fs::path& part : relative) {
    const auto next = entry_in(place, part.string());
    if (!next) {
      return std::nullopt;
    }
    place = *next;
  }
  return place;
}

/// Returns core::FileNames::near() of the folder in which a file should be, and of the scene's own.
std::string names_near(const fs::path& folder, std::string_view name) {
  const auto place = find_inside(folder, fs::path(core::with_slashes(name)).parent_path());
  const std::string there = place ? names_of(entries_of(*place)).near(name) : "";
  return there.empty() ? names_of(entries_of(folder)).near(name) : there;
}

}  // namespace

core::Result<std::string> read_file(const std::string& path) {
  std::error_code problem;
  if (fs::is_directory(path, problem)) {
    return Error{ErrorCode::kInvalidArgument, "is a folder", path};
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return Error{ErrorCode::kNotFound, reason(), path};
  }
  std::string bytes;
  if (const auto size = fs::file_size(path, problem); !problem) {
    bytes.resize(size);
    in.read(bytes.data(), static_cast<std::streamsize>(size));
    bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  } else {  // a pipe
    std::ostringstream text;
    text << in.rdbuf();
    bytes = std::move(text).str();
  }
  if (in.bad()) {
    return Error{ErrorCode::kInvalidArgument, "could not be read", path};
  }
  return bytes;
}

namespace {

/// Returns the file behind symbolic links, which may not exist yet; empty for what cannot be
/// replaced: devices, pipes, and open files such as /dev/stdout.
std::string replaceable(const std::string& path) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    return {};
  }
  constexpr int kLinksMost = 40;  // as Linux
  fs::path file = path;
  for (int i = 0; i < kLinksMost && fs::is_symlink(file, ignored); ++i) {
    if (fs::absolute(file, ignored).string().starts_with("/proc/")) {
      return {};
    }
    file = file.parent_path() / fs::read_symlink(file, ignored);
  }
  return fs::is_symlink(file, ignored) ? std::string() : file.string();
}

core::Status write_in_place(const std::string& path, std::string_view bytes) {
  errno = 0;
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  return out ? core::ok_status()
             : core::Status(Error{ErrorCode::kNoSpace, "cannot be written: " + reason(), path});
}

}  // namespace

core::Status write_file(const std::string& path, std::string_view bytes) {
  if (path == "-") {
    const bool written = std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() &&
                         std::fflush(stdout) == 0;
    return written ? core::ok_status()
                   : core::Status(Error{ErrorCode::kNoSpace, reason(), "stdout"});
  }
  const std::string file = replaceable(path);
  if (file.empty()) {
    return write_in_place(path, bytes);
  }
  const std::string half = file + ".part" + std::to_string(getpid());
  if (core::Status written = write_in_place(half, bytes); !written) {
    std::error_code ignored;
    fs::remove(half, ignored);
    return Error{ErrorCode::kNoSpace, written.error().message, path};
  }
  std::error_code problem;
  fs::rename(half, file, problem);
  if (problem) {
    std::error_code ignored;
    fs::remove(half, ignored);
    return Error{ErrorCode::kNoSpace, "cannot be written: " + problem.message(), path};
  }
  return core::ok_status();
}

core::Status check_writable(const std::string& path) {
  const std::string file = path == "-" ? std::string() : replaceable(path);
  const fs::path folder = fs::path(file).parent_path();
  errno = 0;
  if (file.empty() || ::access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) == 0) {
    return core::ok_status();
  }
  return Error{ErrorCode::kNoSpace, "cannot be written: " + reason(), path};
}

bool is_file(const std::string& path) {
  std::error_code problem;
  return fs::exists(path, problem) && !fs::is_directory(path, problem);
}

core::Result<std::optional<std::string>> model_file(const std::string& path) {
  std::error_code problem;
  if (!fs::is_directory(path, problem)) {
    return is_file(path) ? std::optional(path) : std::nullopt;
  }
  std::vector<std::string> models;
  for (fs::directory_iterator at(path, problem); !problem && at != fs::directory_iterator();
       at.increment(problem)) {
    const std::string file = at->path().string();
    const std::string extension = extension_of(file);
    if (is_file(file) && (extension == "glb" || extension == "gltf")) {
      models.push_back(file);
    }
  }
  if (models.size() == 1) {
    return std::optional(models.front());
  }
  if (path.find('/') == std::string::npos) {
    return std::optional<std::string>();
  }
  if (problem) {
    return Error{ErrorCode::kNotFound, problem.message(), path};
  }
  return Error{ErrorCode::kNotFound,
               models.empty() ? "there is no .glb or .gltf file in this folder"
                              : std::to_string(models.size()) +
                                    " models are in this folder; choose one of them",
               path};
}

std::string extension_of(const std::string& path) {
  const std::string text = core::in_lower_case(fs::path(path).extension().string());
  return text.empty() ? text : text.substr(1);
}

std::string folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

core::Result<std::string> side_file_path(const std::string& folder, std::string_view name) {
  const Error outside = {ErrorCode::kForbidden,
                         "lies outside the scene's folder: a scene may only use files in its own "
                         "folder",
                         std::string(name)};
  if (name.find("://") != std::string_view::npos) {
    return outside;
  }
  std::optional<fs::path> found;
  for (const std::string& spelled : {std::string(name), core::with_slashes(name)}) {
    const auto plain = core::plain_name(spelled);
    if (!plain) {
      return outside;
    }
    found = found ? found : find_inside(folder, *plain);
  }
  std::error_code problem;
  const fs::path home = fs::canonical(folder, problem);
  const fs::path file = found ? fs::canonical(*found, problem) : fs::path();
  if (!found || problem) {
    return Error{ErrorCode::kNotFound,
                 "is used by the scene but does not exist" + names_near(folder, name),
                 std::string(name)};
  }
  const auto [end, rest] = std::mismatch(home.begin(), home.end(), file.begin(), file.end());
  return end == home.end() ? core::Result<std::string>(file.string()) : outside;
}

}  // namespace cli
