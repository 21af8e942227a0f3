#include "clients/cli/sibling.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

#include <unistd.h>

#include "clients/cli/cli.h"

namespace cli {

int execute_sibling(char** argv) {
  std::error_code problem;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", problem);
  const std::string program = (self.parent_path() / "tessera-server").string();
  execvp(program.c_str(), argv);  // without /proc: the program in PATH
  std::fprintf(stderr, "tessera: cannot start %s: %s\n", program.c_str(), std::strerror(errno));
  return kFailed;
}

}  // namespace cli
