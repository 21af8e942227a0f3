#include "tests/simulation/copier.h"

#include <array>
#include <cstdio>

#include <sys/wait.h>
#include <unistd.h>

#include "core/base/check.h"
#include "server/commands/backup_command.h"

namespace simulation {
namespace {

/// Each request is a line "FROM\tTO", each answer a byte.
void serve(std::FILE* requests, int answers) {
  std::array<char, 4096> from{};
  std::array<char, 4096> to{};
  while (std::fscanf(requests, " %4095[^\t]\t%4095[^\n]", from.data(), to.data()) == 2) {
    const pid_t child = ::fork();
    if (child == 0) {
      const auto copied = server::back_up(from.data(), to.data());
      std::fputs(copied ? "" : (copied.error().message + "\n").c_str(), stdout);
      std::fflush(stdout);
      ::_exit(copied ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    const char answer = status == 0 ? 1 : 0;
    CHECK(::write(answers, &answer, 1) == 1);
  }
}

}  // namespace

Copier::Copier() {
  std::array<int, 2> requests{};
  std::array<int, 2> answers{};
  CHECK(::pipe(requests.data()) == 0 && ::pipe(answers.data()) == 0);
  process_ = ::fork();
  if (process_ == 0) {
    ::close(requests[1]);
    ::close(answers[0]);
    serve(::fdopen(requests[0], "r"), answers[1]);
    ::_exit(0);
  }
  ::close(requests[0]);
  ::close(answers[1]);
  requests_ = requests[1];
  answers_ = answers[0];
}

Copier::~Copier() {
  ::close(requests_);
  ::close(answers_);
  ::waitpid(process_, nullptr, 0);
}

bool Copier::copy(const std::string& from, const std::string& to) const {
  const std::string request = from + "\t" + to + "\n";
  char answer = 0;
  return ::write(requests_, request.data(), request.size()) ==
             static_cast<ssize_t>(request.size()) &&
         ::read(answers_, &answer, 1) == 1 && answer == 1;
}

}  // namespace simulation
