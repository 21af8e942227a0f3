/// Exit codes of every verb.
#pragma once

namespace flags {

inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

}  // namespace flags
