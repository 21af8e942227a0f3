// Separate from verb_text.cpp, which every verb needs: this file needs every verb.
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/cli/verb_text.h"

extern char** environ;

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

Error system_error(int code) {
  return Error{ErrorCode::kInternal, std::error_code(code, std::generic_category()).message(),
               "/proc/self/exe"};
}

std::string read_all(int pipe_end) {
  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t count = 0; (count = read(pipe_end, piece.data(), piece.size())) > 0;) {
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return text;
}

/// Returns the output of `tessera VERB --describe`.
core::Result<std::string> ask(std::string verb) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return system_error(errno);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  std::string name = "tessera";
  std::string flag(kDescribe);
  const std::array<char*, 4> args = {name.data(), verb.data(), flag.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawn(&child, "/proc/self/exe", &actions, nullptr, args.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string text = failed == 0 ? read_all(ends[0]) : "";
  close(ends[0]);
  if (failed != 0) {
    return system_error(failed);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != kDone) {
    return Error{ErrorCode::kInternal, "cannot be described", verb};
  }
  return text;
}

}  // namespace

core::Result<std::vector<VerbText>> describe_verbs() {
  std::vector<VerbText> found;
  for (const Verb& verb : verbs()) {
    const auto said = ask(std::string(verb.name));
    if (!said) {
      return said.error();
    }
    auto text = read_verb_text(verb, *said);
    if (!text) {
      return text.error();
    }
    found.push_back(*std::move(text));
  }
  share_choices(found);
  return found;
}

}  // namespace cli
