/// The job's group `integrator`: the algorithm, and the options of individual integrators.
#pragma once

#include <string_view>

#include "api/json/fields.h"
#include "api/json/limits.h"

namespace api {

/// Applies the row to integrators that list it.
template <typename Row>
constexpr auto own_option(std::string_view pointer, Row row) {
  return option_of(
      pointer, [](const auto& s) -> const auto& { return s.render.integrator; }, &core::integrators,
      row);
}

constexpr auto integrator_row() {
  return group(
      "integrator", "How light paths are traced.",
      choice(
          "type", [](auto& s) -> auto& { return s.render.integrator; }, &core::integrators,
          "Algorithm."),
      number(
          "max_depth", [](auto& s) -> auto& { return s.render.max_depth; }, {0, limits::kMaxDepth},
          "Scattering events on a path; 0 shows emitters only, 1 adds direct light."),
      own_option(
          "/integrator/caustics",
          shown_if([](const auto& s) { return s.render.caustics != core::CausticsType::kOff; },
                   choice(
                       "caustics", [](auto& s) -> auto& { return s.render.caustics; },
                       &core::caustics_types,
                       "Whether photons bring what lamps and sun send through glass and water or "
                       "off mirrors. The job then has the options, and the type, of "
                       "path-caustics."))),
      own_option("/integrator/photons",
                 number(
                     "photons", [](auto& s) -> auto& { return s.render.photons.paths; },
                     {0, limits::kPhotons},
                     "Particles emitted from the lights for each sample of the pixels; 0: one per "
                     "pixel of the full film (path-caustics: one per two pixels), at least 4096 "
                     "and at most 262144.")),
      own_option(
          "/integrator/radius_m",
          number(
              "radius_m", [](auto& s) -> auto& { return s.render.photons.radius_m; }, {0, 1e6},
              "Radius within which photons are gathered, in metres; sppm and vcm: initial radius. "
              "0: three pixels at the distance of the visible surfaces.")),
      own_option(
          "/integrator/alpha",
          number(
              "alpha", [](auto& s) -> auto& { return s.render.photons.alpha; }, {0.1, 1},
              "After N samples of each replicate, the area in which photons are gathered, and the "
              "bias, are about N^(alpha - 1) of the initial ones; the variance falls as N^-alpha. "
              "With 2/3 the squared bias and the variance fall at the same rate.")),
      own_option("/integrator/final_gather",
                 number(
                     "final_gather", [](auto& s) -> auto& { return s.render.photons.final_gather; },
                     {0, limits::kFinalGather},
                     "Directions in which each path continues to look up the photon map at the "
                     "next surface; 0: shows the map itself, including direct light.")),
      own_option(
          "/integrator/tolerance",
          number(
              "tolerance", [](auto& s) -> auto& { return s.render.cache.tolerance; }, {0.05, 1},
              "Relative interpolation error up to which an irradiance record is used; half of it "
              "needs about four times as many records.")),
      own_option("/integrator/rays",
                 number(
                     "rays", [](auto& s) -> auto& { return s.render.cache.rays; },
                     {limits::kRecordRaysLeast, limits::kRecordRays},
                     "Paths over the hemisphere of each record.")),
      own_option("/integrator/records",
                 number(
                     "records", [](auto& s) -> auto& { return s.render.cache.records; },
                     {1, limits::kRecords},
                     "Maximum number of records of each replicate. Where there are none, indirect "
                     "light is path traced.")));
}

}  // namespace api
