#include "clients/cli/progress.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "clients/cli/terminal.h"

namespace cli {
namespace {

std::string printed(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Prints three significant digits without an exponent.
std::string three_digits(double value) {
  const int decimals = value >= 100 ? 0 : value >= 10 ? 1 : value >= 1 ? 2 : 3;
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string percent_text(double relative_error) { return three_digits(relative_error * 100); }

std::string percent_done(double fraction) {
  return std::to_string(static_cast<int>(std::clamp(fraction, 0.0, 1.0) * 100)) + "%";
}

std::string error_part(const ProgressFacts& facts, bool with_interval) {
  return with_interval ? interval_text(facts) : "error " + error_text(facts.relative_error);
}

/// with_interval: prints the interval of the error if it is known.
std::vector<std::string> parts(const ProgressFacts& facts, bool with_interval) {
  std::vector<std::string> out;
  out.push_back(percent_done(facts.fraction));
  out.push_back(printed("%.0f", facts.samples_per_pixel) + " samples");
  if (!std::isnan(facts.relative_error)) {
    out.push_back(error_part(facts, with_interval));
  }
  const bool is_rendering = facts.state == "rendering";
  if (is_rendering && facts.rays_per_second > 0) {
    out.push_back(rate_text(facts.rays_per_second));
  }
  out.push_back(is_rendering && facts.eta_seconds ? "ETA " + duration_text(*facts.eta_seconds)
                                                  : duration_text(facts.elapsed_seconds));
  return out;
}

}  // namespace

std::string duration_text(double seconds) {
  if (!(seconds < 1e9)) {
    return "long";
  }
  if (seconds < 0.995) {
    return printed("%.2f s", std::max(seconds, 0.0));
  }
  if (seconds < 10) {
    return printed("%.1f s", seconds);
  }
  const auto whole = static_cast<long long>(std::lround(seconds));
  if (whole < 60) {
    return std::to_string(whole) + " s";
  }
  if (whole < 3600) {
    return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  }
  return std::to_string(whole / 3600) + " h " + std::to_string(whole % 3600 / 60) + " min";
}

std::string error_text(double relative_error) {
  return std::isnan(relative_error) ? "unknown" : percent_text(relative_error) + "%";
}

std::string interval_text(const ProgressFacts& facts) {
  std::string text = "error " + error_text(facts.relative_error);
  if (!std::isnan(facts.error_low) && !std::isnan(facts.error_high)) {
    text += " (" + percent_text(facts.error_low) + " to " + percent_text(facts.error_high) + ")";
  }
  return text + (facts.is_unreliable ? ", unreliable" : "");
}

std::string rate_text(double rays_per_second) {
  return rays_per_second >= 1e6 ? three_digits(rays_per_second / 1e6) + " Mrays/s"
                                : three_digits(rays_per_second / 1e3) + " krays/s";
}

std::string progress_text(const ProgressFacts& facts) {
  std::string text = facts.state;
  for (const std::string& part : parts(facts, true)) {
    text += "  " + part;
  }
  return text;
}

std::string progress_bar(const ProgressFacts& facts, int columns, bool unicode) {
  constexpr int kBarColumns = 14;
  const auto length = [](const std::vector<std::string>& words) {
    std::size_t sum = 0;
    for (const std::string& word : words) {
      sum += 2 + word.size();
    }
    return static_cast<int>(sum);
  };
  std::vector<std::string> words = parts(facts, true);
  if (length(words) + kBarColumns > columns) {
    words = parts(facts, false);
  }
  // Drops the speed before the remaining time, which is last and more important.
  while (words.size() > 1 && length(words) + kBarColumns > columns) {
    words.erase(words.end() - (words.size() > 2 ? 2 : 1));
  }
  std::string tail;
  for (const std::string& word : words) {
    tail += "  " + word;
  }
  const int cells = std::clamp(columns - static_cast<int>(tail.size()) - 3, 0, 30);
  const int full = static_cast<int>(std::clamp(facts.fraction, 0.0, 1.0) * cells);
  std::string bar = "[";
  for (int i = 0; i < cells; ++i) {
    const bool on = i < full;
    bar += unicode ? (on ? "\u2588" : "\u2591") : (on ? "#" : "-");
  }
  return bar + "]" + tail;
}

ProgressPrinter::ProgressPrinter(std::FILE* out)
    : out_(out), terminal_(is_terminal(out)), unicode_(speaks_utf8()) {}

ProgressPrinter::~ProgressPrinter() { clear(); }

void ProgressPrinter::show(const ProgressFacts& facts) {
  const auto now = std::chrono::steady_clock::now();
  if (terminal_) {
    std::fprintf(out_, "\r\x1b[2K%s",
                 progress_bar(facts, terminal_size(out_).columns - 1, unicode_).c_str());
    drawn_ = true;
  } else {
    const bool due = facts.state != state_ || facts.fraction >= fraction_ + 0.05 ||
                     now - printed_at_ >= std::chrono::seconds(5);
    if (!due) {
      return;
    }
    std::fprintf(out_, "%s\n", progress_text(facts).c_str());
  }
  std::fflush(out_);
  state_ = facts.state;
  fraction_ = facts.fraction;
  printed_at_ = now;
}

void ProgressPrinter::say(const std::string& line) {
  clear();
  std::fprintf(out_, "%s\n", line.c_str());
  std::fflush(out_);
}

void ProgressPrinter::clear() {
  if (drawn_) {
    std::fprintf(out_, "\r\x1b[2K");
    std::fflush(out_);
    drawn_ = false;
  }
}

}  // namespace cli
