/// Which build a program is.
#pragma once

#include <string>

namespace core {

/// The linker's hash of this program, from its NT_GNU_BUILD_ID note; empty when it made none.
std::string linker_build_id();

}  // namespace core
