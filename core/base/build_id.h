/// Identifies the build of a program.
#pragma once

#include <string>

namespace core {

/// Returns the linker's hash of this program from its NT_GNU_BUILD_ID note; empty if there is none.
std::string linker_build_id();

}  // namespace core
