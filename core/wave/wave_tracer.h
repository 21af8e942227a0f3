/// make_wave_tracer: waves for the jobs that they serve.
#pragma once

#include <memory>
#include <string_view>

#include "core/wave/wave.h"

namespace core {

/// Null where paths are traced one by one: another integrator than "path", options beside the
/// defaults, or an Embree without packets. width: lanes, 8, or 1 for tests.
std::unique_ptr<const WaveTracer> make_wave_tracer(const IntegratorInput& input, int width = 8);

/// May there be waves where Embree is held to `isa` (resolve_isa())? The lanes are AVX2, which the
/// build chooses, and packets of eight need AVX.
bool waves_serve(std::string_view isa) noexcept;

}  // namespace core
