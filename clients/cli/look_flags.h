/// Flags of the look of a written image, shared by `render`, `submit` and `fetch`.
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "core/base/result.h"

namespace cli {

struct LookFlags {
  std::optional<double> white_balance_k;  ///< of the light that is shown as white
  double contrast = 1;                    ///< slope in stops about middle grey
  int bits = 8;                           ///< of each channel; 16 only in png
};

void add_look_options(CLI::App& app, LookFlags& flags);
/// Refuses flags that the format, an extension, cannot honour, as the server does.
core::Status check_look_flags(const LookFlags& flags, const std::string& format, bool is_linear);

}  // namespace cli
