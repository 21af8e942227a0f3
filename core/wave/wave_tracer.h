/// make_wave_tracer: waves for the jobs that support them.
#pragma once

#include <memory>
#include <string_view>

#include "core/wave/wave.h"

namespace core {

/// Returns null for jobs that require scalar tracing: integrators whose row does not say
/// `in_lanes`, estimators other than the defaults with any number of light candidates, a camera in
/// a solid, or an Embree without packets; fog whose density falls, or with light samples along
/// segments, light candidates or wavelengths. width: lanes, 8, or 1 for tests.
std::unique_ptr<const WaveTracer> make_wave_tracer(const IntegratorInput& input, int width = 8);

/// Returns whether waves run when Embree is limited to `isa` (resolve_isa()): where
/// Accel::has_packets().
bool waves_serve(std::string_view isa) noexcept;

}  // namespace core
