/// Describes the arithmetic that determines an image's bits besides the job and the build: Embree's
/// version and instruction set, the processor, and the C library's math functions.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"

namespace core {

/// Returns the instruction set that Embree uses for `isa`; "native" is the widest that this machine
/// and this Embree support. Errors: kInvalidArgument for an unknown name, or one that the machine
/// or the library lacks.
Result<std::string> resolve_isa(std::string_view isa);

/// Returns a text such as "embree 4.3.0, avx2, GenuineIntel, glibc 2.36", or "embree 3.13.5, neon,
/// arm64, glibc 2.36". isa: as returned by resolve_isa(). Equal texts guarantee equal bits for one
/// build; different texts guarantee nothing.
std::string arithmetic_class(std::string_view isa);

/// Returns the architecture of an arithmetic class: "arm64" or "x86-64".
std::string_view architecture_of(std::string_view arithmetic) noexcept;

}  // namespace core
