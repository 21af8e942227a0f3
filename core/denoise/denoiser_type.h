/// Denoisers that a job can request.
#pragma once

#include <span>

#include "core/settings/choices.h"

namespace core {

enum class DenoiserType { kNone, kAuto, kStatistical, kOidn };
std::span<const NamedValue<DenoiserType>> denoisers();

}  // namespace core
