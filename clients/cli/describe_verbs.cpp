// Separate from verb_text.cpp, which every verb needs: this file needs every verb.
#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/cli/sibling.h"
#include "clients/cli/verb_text.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

Error system_error(int code) {
  return Error{ErrorCode::kInternal, std::error_code(code, std::generic_category()).message(),
               "the description of a verb"};
}

std::string read_all(int pipe_end) {
  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t count = 0; (count = read(pipe_end, piece.data(), piece.size())) > 0;) {
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return text;
}

/// Ends the process by `tessera VERB --describe`.
[[noreturn]] void describe(const Verb& verb) {
  std::string program = "tessera";
  std::string name(verb.name);
  std::string flag(kDescribe);
  std::array<char*, 4> args = {program.data(), name.data(), flag.data(), nullptr};
  const int code = verb.run != nullptr ? verb.run({flag}) : execute_sibling(args.data());
  std::fflush(stdout);
  _exit(code);
}

/// Returns the output of `tessera VERB --describe`.
core::Result<std::string> ask(const Verb& verb) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return system_error(errno);
  }
  std::fflush(stdout);  // else the child writes it, too
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    describe(verb);
  }
  const int failed = child < 0 ? errno : 0;
  close(ends[1]);
  std::string text = failed == 0 ? read_all(ends[0]) : "";
  close(ends[0]);
  if (failed != 0) {
    return system_error(failed);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != kDone) {
    return Error{ErrorCode::kInternal, "cannot be described", std::string(verb.name)};
  }
  return text;
}

}  // namespace

core::Result<std::vector<VerbText>> describe_verbs() {
  std::vector<VerbText> found;
  for (const Verb& verb : verbs()) {
    const auto said = ask(verb);
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
