// Ends the program with a sentence on a processor that lacks the instructions it is built for,
// before any of them runs. Part of each program, compiled for any x86-64.
#include <cstring>

#include <unistd.h>

namespace {

// The first priority that programs may use: before all static objects.
__attribute__((constructor(101))) void check_processor() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
      __builtin_cpu_supports("bmi2") != 0) {
    return;
  }
  constexpr const char* kText =
      "tessera: this build needs a processor with AVX2, FMA and BMI2 (x86-64-v3); in a virtual "
      "machine, set the type of its processor to host\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText, std::strlen(kText));
  ::_exit(1);
}

}  // namespace
