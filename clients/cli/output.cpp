#include "clients/cli/output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>

#include "clients/cli/cli.h"

namespace cli {

int checked_output(const char* program, int code) {
  errno = 0;
  std::cout.flush();
  const bool is_flushed = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (is_flushed && std::cout.good()) {
    return code;
  }
  std::fprintf(stderr, "%s: the output could not be written%s%s\n", program, errno == 0 ? "" : ": ",
               errno == 0 ? "" : std::strerror(errno));
  return code == kDone ? kFailed : code;
}

}  // namespace cli
