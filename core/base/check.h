/// CHECK(x) aborts the process on a programming error. Never use it to validate input.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace core {

[[noreturn]] inline void check_failed(const char* what, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: CHECK failed: %s\n", file, line, what);
  std::abort();
}

}  // namespace core

#define CHECK(x) ((x) ? static_cast<void>(0) : ::core::check_failed(#x, __FILE__, __LINE__))

#ifdef NDEBUG
#define DCHECK(x) static_cast<void>(sizeof(!(x)))
#else
#define DCHECK(x) CHECK(x)
#endif
