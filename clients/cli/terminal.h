/// Properties of the terminal behind a stream.
#pragma once

#include <csignal>
#include <cstdio>

namespace cli {

struct TerminalSize {
  int columns = 80;
  int rows = 24;
  int width_px = 0;  ///< of the whole text area; 0: unknown
  int height_px = 0;

  bool operator==(const TerminalSize&) const = default;
};

bool is_terminal(std::FILE* out);
/// Returns 80 by 24 cells if `out` is not a terminal or its size is unknown.
TerminalSize terminal_size(std::FILE* out);
/// Decides by LC_ALL, LC_CTYPE and LANG.
bool speaks_utf8();

/// Blocks signals that would end the process (Ctrl-C, a closed terminal) in this thread during its
/// lifetime: output is written completely, and leaves colours and cursor in their normal state.
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
