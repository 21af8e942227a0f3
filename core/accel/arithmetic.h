/// The arithmetic that a picture's bits depend on besides the job and the build: Embree's version
/// and instruction set, the processor's maker, the C library's mathematics.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace core {

/// Instruction sets that Embree can be restricted to, the narrowest first.
std::span<const std::string_view> embree_isas() noexcept;

/// The instruction set that Embree traces with when it is asked for `isa`; "native" is the widest
/// that this machine and this Embree have. Errors: kInvalidArgument for an unknown name, or one
/// that the machine or the library lacks.
Result<std::string> resolve_isa(std::string_view isa);

/// "embree 4.3.0, avx2, GenuineIntel, glibc 2.36". isa: as resolve_isa() gives it. Equal texts
/// promise equal bits of one build; unequal ones promise nothing.
std::string arithmetic_class(std::string_view isa);

}  // namespace core
