#include "clients/cli/video.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

/// Returns false if the other end is closed.
bool send_all(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    // Avoids SIGPIPE when ffmpeg has exited.
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EINTR) {
      return false;
    }
    bytes.remove_prefix(sent > 0 ? static_cast<std::size_t>(sent) : 0);
  }
  return true;
}

/// Starts ffmpeg with `input` as its standard input. Returns 0 or an errno.
int spawn_ffmpeg(const VideoOptions& options, int input, pid_t& child) {
  std::vector<std::string> words = {
      "ffmpeg", "-hide_banner", "-loglevel", "error", "-y",
      // The images are concatenated.
      "-f", "image2pipe", "-framerate", std::to_string(options.frames_per_second), "-c:v", "png",
      "-i", "-",
      // Players require even sides and chroma of half the resolution.
      "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "file:" + options.output};
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) {
    arguments.push_back(word.data());
  }
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  const int code = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  return code;
}

/// Returns whether the process ended successfully.
bool ends_well(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) {
      return false;
    }
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

Error no_ffmpeg() {
  return {ErrorCode::kNotFound,
          "a video needs ffmpeg, which is not on the PATH; install it, or take the images with -o",
          "--video"};
}

}  // namespace

core::Status find_ffmpeg() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((folder + "/ffmpeg").c_str(), X_OK) == 0) {
      return core::ok_status();
    }
  }
  return no_ffmpeg();
}

core::Status write_video(const VideoOptions& options, std::size_t count,
                         const std::function<core::Result<std::string>(std::size_t)>& frame) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Error{ErrorCode::kInternal, "cannot create a pipe to ffmpeg", ""};
  }
  pid_t child = 0;
  const int code = spawn_ffmpeg(options, ends[1], child);
  close(ends[1]);
  if (code != 0) {
    close(ends[0]);
    return no_ffmpeg();
  }
  core::Status result = core::ok_status();
  for (std::size_t i = 0; i < count && result; ++i) {
    const auto png = frame(i);
    if (!png) {
      result = png.error();
    } else if (!send_all(ends[0], *png)) {
      break;  // ffmpeg has ended; its exit code is checked below
    }
  }
  close(ends[0]);
  if (!ends_well(child) && result) {
    result = Error{ErrorCode::kInternal, "ffmpeg failed", options.output};
  }
  if (!result) {
    std::remove(options.output.c_str());
  }
  return result;
}

}  // namespace cli
