/// The vector intrinsics of x86-64 with AVX2, FMA and F16C: the compiler's, or, on other
/// processors, those of SIMDe (MIT licence), which computes the same by what they have.
#pragma once

#ifdef __x86_64__
#include <immintrin.h>
#else
#define SIMDE_ENABLE_NATIVE_ALIASES
#include <simde/x86/avx2.h>
#include <simde/x86/f16c.h>
#include <simde/x86/fma.h>
#endif
