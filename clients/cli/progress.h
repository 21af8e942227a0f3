/// Progress of a render: a bar on a terminal, plain lines in a pipe or a file.
#pragma once

#include <chrono>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>

namespace cli {

struct ProgressFacts {
  std::string state = "rendering";
  double fraction = 0;           ///< 0 to 1
  double samples_per_pixel = 0;  ///< mean so far
  double elapsed_seconds = 0;
  double relative_error = std::numeric_limits<double>::quiet_NaN();  ///< NaN: unknown
  double error_low = std::numeric_limits<double>::quiet_NaN();
  double error_high = std::numeric_limits<double>::quiet_NaN();
  bool is_unreliable = false;  ///< rare bright paths may be missing
  double rays_per_second = 0;
  std::optional<double> eta_seconds;
};

/// "0.83 s", "12 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);
/// "2.31%" to three digits; "unknown" for NaN.
std::string error_text(double relative_error);
/// "error 2.31% (2.1% to 2.5%)"; may end in ", unreliable".
std::string interval_text(const ProgressFacts& facts);
/// "4.21 Mrays/s".
std::string rate_text(double rays_per_second);

/// Returns one line of plain text without the bar.
std::string progress_text(const ProgressFacts& facts);
/// Returns the bar and the facts in at most `columns` columns; if these are few, drops first the
/// interval of the error, then the speed, the error, the samples. unicode: block characters,
/// otherwise '#'.
std::string progress_bar(const ProgressFacts& facts, int columns, bool unicode);

/// Prints facts as they arrive. On a terminal one line is redrawn; otherwise a line is printed when
/// the state changes, after another 5% of the work, or after five seconds.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(std::FILE* out);
  ~ProgressPrinter();
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void show(const ProgressFacts& facts);
  /// Prints a line above the bar.
  void say(const std::string& line);
  /// Removes the bar.
  void clear();

 private:
  std::FILE* out_;
  bool terminal_;
  bool unicode_;
  bool drawn_ = false;
  std::string state_;
  double fraction_ = -1;
  std::chrono::steady_clock::time_point printed_at_;
};

}  // namespace cli
