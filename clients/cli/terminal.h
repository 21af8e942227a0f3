/// What is known about the terminal behind a stream.
#pragma once

#include <csignal>
#include <cstdio>

namespace cli {

struct TerminalSize {
  int columns = 80;
  int rows = 24;
  int width_px = 0;  ///< of the whole text area; 0: the terminal does not say
  int height_px = 0;

  bool operator==(const TerminalSize&) const = default;
};

bool is_terminal(std::FILE* out);
/// 80 by 24 cells where `out` is no terminal or does not say.
TerminalSize terminal_size(std::FILE* out);
/// By LC_ALL, LC_CTYPE and LANG.
bool speaks_utf8();

/// While it lives, a signal that would end the process (Ctrl-C, a closed terminal) waits in this
/// thread: what is written meanwhile comes out whole, and ends with colours and cursor as they
/// were.
class SignalsHeld {
 public:
  SignalsHeld();
  ~SignalsHeld();
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;

 private:
  sigset_t before_;
};

}  // namespace cli
