#include "clients/cli/terminal.h"

#include <cstdlib>
#include <string_view>

#include <sys/ioctl.h>
#include <unistd.h>

namespace cli {

bool is_terminal(std::FILE* out) { return isatty(fileno(out)) == 1; }

TerminalSize terminal_size(std::FILE* out) {
  TerminalSize size;
  winsize told = {};
  if (ioctl(fileno(out), TIOCGWINSZ, &told) == 0 && told.ws_col > 0) {
    size.columns = told.ws_col;
    size.rows = told.ws_row > 0 ? told.ws_row : size.rows;
    size.width_px = told.ws_xpixel;
    size.height_px = told.ws_ypixel;
  }
  return size;
}

bool speaks_utf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): never set.
    if (value != nullptr && *value != 0) {
      const std::string_view text = value;
      return text.find("UTF-8") != std::string_view::npos ||
             text.find("utf8") != std::string_view::npos;
    }
  }
  return false;
}

SignalsHeld::SignalsHeld() : before_() {
  sigset_t held;
  sigemptyset(&held);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGTSTP}) {
    sigaddset(&held, signal);
  }
  pthread_sigmask(SIG_BLOCK, &held, &before_);
}

SignalsHeld::~SignalsHeld() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

}  // namespace cli
