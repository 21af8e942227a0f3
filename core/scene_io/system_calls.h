/// What seccomp filters compare with seccomp_data.arch before they trust numbers of system calls.
#pragma once

#include <linux/audit.h>

namespace core {

#ifdef __x86_64__
constexpr unsigned kSystemCalls = AUDIT_ARCH_X86_64;
#else
constexpr unsigned kSystemCalls = AUDIT_ARCH_AARCH64;
#endif

}  // namespace core
